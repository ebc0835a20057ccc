//! Small programs for the board, put together from instructions.

use upright_board::{Conditions, Image, Rules, SimulatedBoard, Stopped};

/// End of the stack of every program.
pub(crate) const STACK: u32 = 0x2000_2000;
/// Address at which programs log what they have read.
pub(crate) const LOG: u32 = 0x2000_4000;

pub(crate) const NOP: u16 = 0xbf00;
pub(crate) const WFI: u16 = 0xbf30;
pub(crate) const RETURN: u16 = 0x4770;
pub(crate) const FOREVER: u16 = 0xe7fe;
pub(crate) const INTERRUPTS_OFF: u16 = 0xb672;
pub(crate) const INTERRUPTS_ON: u16 = 0xb662;
pub(crate) const SYNC: [u16; 2] = [0xf3bf, 0x8f4f];

pub(crate) const AHB1ENR: u32 = 0x4002_3830;
pub(crate) const APB1ENR: u32 = 0x4002_3840;
pub(crate) const APB2ENR: u32 = 0x4002_3844;

/// The clocks of all ports, the DMA, and the peripherals of both buses.
pub(crate) fn clocks_on() -> Code {
    Code::new()
        .write(AHB1ENR, 1 << 20 | 1 << 21 | 0x1ff)
        .write(APB1ENR, 0x1002_000f)
        .write(APB2ENR, 0x0004_4103)
        .raw(&SYNC)
}

/// Instructions in order.
#[derive(Clone, Default)]
pub(crate) struct Code(pub(crate) Vec<u16>);

impl Code {
    pub(crate) fn new() -> Self {
        Self::default()
    }

    pub(crate) fn raw(mut self, halves: &[u16]) -> Self {
        self.0.extend_from_slice(halves);
        self
    }

    /// MOVW and MOVT.
    pub(crate) fn set(self, register: u16, value: u32) -> Self {
        let half = |first: u16, value: u16| {
            let (i, imm4, imm3, imm8) = (value >> 11 & 1, value >> 12, value >> 8 & 7, value & 0xff);
            [first | i << 10 | imm4, imm3 << 12 | register << 8 | imm8]
        };
        self.raw(&half(0xf240, value as u16)).raw(&half(0xf2c0, (value >> 16) as u16))
    }

    /// Writes a word with R0 and R1.
    pub(crate) fn write(self, address: u32, value: u32) -> Self {
        self.set(0, address).set(1, value).raw(&[0x6001])
    }

    /// Reads a word into R2, with R0.
    pub(crate) fn read(self, address: u32) -> Self {
        self.set(0, address).raw(&[0x6802])
    }

    /// Reads a word and leaves it in the log.
    pub(crate) fn log(self, address: u32, place: u32) -> Self {
        self.read(address).set(0, LOG + 4 * place).raw(&[0x6002])
    }

    /// Appends a byte to the log: its length is the first word.
    pub(crate) fn append(self, byte: u8) -> Self {
        // r0 = LOG; r1 = [r0]; r1 += 1; [r0] = r1; r2 = byte; [r0 + r1 + 3] = r2
        self.set(0, LOG).raw(&[0x6801, 0x3101, 0x6001, 0x1840, 0x2200 | u16::from(byte), 0x70c2])
    }
}

/// Flash with vectors, the main program and handlers, and an endless loop after each part.
pub(crate) fn image(main: &Code, handlers: &[(usize, Code)]) -> Image {
    let mut code: Vec<u16> = Vec::new();
    let mut vectors = [0x0800_0201u32; 128];
    code.push(FOREVER);
    let mut place = |part: &Code| {
        let address = 0x0800_0200 + 2 * code.len() as u32;
        code.extend_from_slice(&part.0);
        code.push(FOREVER);
        address | 1
    };
    vectors[0] = STACK;
    vectors[1] = place(&Code::new().write(LOG, 0).raw(&main.0));
    for (exception, handler) in handlers {
        vectors[*exception] = place(handler);
    }
    let vectors = vectors.iter().flat_map(|vector| vector.to_le_bytes());
    Image::from_flash(vectors.chain(code.iter().flat_map(|half| half.to_le_bytes())).collect())
}

/// A board with this program.
pub(crate) fn board(main: &Code, handlers: &[(usize, Code)], rules: Rules) -> SimulatedBoard {
    SimulatedBoard::power_on(&image(main, handlers), &Conditions::f405(7), rules).expect("good vectors")
}

/// Runs a program for some microseconds.
pub(crate) fn run(
    main: &Code,
    handlers: &[(usize, Code)],
    microseconds: u64,
) -> Result<SimulatedBoard, Stopped> {
    let mut board = board(main, handlers, Rules::STRICT);
    board.run_until(microseconds * upright_board::UNITS_PER_MICROSECOND)?;
    Ok(board)
}

/// The bytes that a program has appended.
pub(crate) fn appended(board: &SimulatedBoard) -> Vec<u8> {
    let length = board.word(LOG).unwrap_or(0);
    (0..length).map(|i| (board.word((LOG + 4 + i) & !3).unwrap_or(0) >> (8 * (i & 3))) as u8).collect()
}

/// A word that a program has logged.
pub(crate) fn logged(board: &SimulatedBoard, place: u32) -> u32 {
    board.word(LOG + 4 * place).unwrap_or(0)
}
