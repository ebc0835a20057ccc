//! Chooses the linker's scripts: one for the memory of the chip, one for the sections.

fn main() {
    let variable = |name: &str| std::env::var(name).unwrap_or_default();
    let is_rp2350 = variable("TARGET").starts_with("thumbv8m.main");
    println!("cargo::rustc-check-cfg=cfg(rp2350)");
    if is_rp2350 {
        println!("cargo::rustc-cfg=rp2350");
    }
    let memory = if is_rp2350 { "rp2350.x" } else { "rp2040.x" };
    let folder = variable("CARGO_MANIFEST_DIR");
    for script in [memory, "image.x"] {
        println!("cargo::rustc-link-arg=-T{folder}/{script}");
        println!("cargo::rerun-if-changed={script}");
    }
    println!("cargo::rustc-link-arg=--nmagic");
}
