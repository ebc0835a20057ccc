use upright_board::*;
fn main() {
    let image = Image::from_elf(&std::fs::read(std::env::args().nth(1).unwrap()).unwrap()).unwrap();
    let mk = |skip| { let mut b = Board::power_on(&image, &Conditions::f405(1), Wiring::upright(), Rules::NOTED).unwrap(); b.skip_waiting(skip); b };
    let (mut a, mut b) = (mk(true), mk(false));
    for i in 1..2000u64 {
        let t = i * 25_200_0;
        a.run_until(t).unwrap(); b.run_until(t).unwrap();
        if a.registers() != b.registers() || a.instructions().0 != b.instructions().0 || a.now() != b.now() {
            println!("{i}: {:x?}\n{:x?}\n{:?} {:?} {} {}", a.registers(), b.registers(), a.instructions(), b.instructions(), a.now(), b.now());
            return;
        }
    }
    println!("same {:?}", a.instructions());
}
