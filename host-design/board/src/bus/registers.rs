//! Accesses to registers: address map (RM0090, 2.3), clocks, widths and reserved bits.

use super::Bus;
use crate::error::{Trap, Violation};
use crate::peripherals::Bits;
use crate::peripherals::adc::Adc;
use crate::peripherals::capture_timer::CaptureTimer;
use crate::peripherals::dma::Dma;
use crate::peripherals::exti::Exti;
use crate::peripherals::iwdg::Iwdg;
use crate::peripherals::rcc::Domain;
use crate::peripherals::usart::Usart;

/// A peripheral that is modelled.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Block {
    Encoder(usize),
    Iwdg,
    Usart,
    Power,
    Pwm,
    Adc,
    Syscfg,
    Exti,
    Capture,
    Port(usize),
    Rcc,
    Flash,
    Dma,
    Debug,
}

/// The peripheral at an address, and its base; of the USARTs, only that of the serial line exists.
fn place(address: u32, usart: u8) -> Option<(Block, u32)> {
    let block = address & !0x3ff;
    let found = match block {
        0x4000_0000..=0x4000_0c00 => (Block::Encoder((block as usize >> 10) & 3), block),
        0x4000_3000 => (Block::Iwdg, block),
        0x4000_4400 if usart == 2 => (Block::Usart, block),
        0x4000_4800 if usart == 3 => (Block::Usart, block),
        0x4000_7000 => (Block::Power, block),
        0x4001_0000 => (Block::Pwm, block),
        0x4001_0400 => (Block::Encoder(4), block),
        0x4001_2000 => (Block::Adc, block),
        0x4001_3800 => (Block::Syscfg, block),
        0x4001_3c00 => (Block::Exti, block),
        0x4001_4800 => (Block::Capture, block),
        0x4002_0000..=0x4002_2000 => (Block::Port((block as usize >> 10) & 15), block),
        0x4002_3800 => (Block::Rcc, block),
        0x4002_3c00 => (Block::Flash, block),
        0x4002_6000 => (Block::Dma, block),
        0xe004_2000 => (Block::Debug, block),
        _ => return None,
    };
    Some(found)
}

/// The bus and the clock-enable bit of a peripheral (7.3.10 to 7.3.14).
fn clock(place: Block, usart: u8) -> Option<(Domain, u32)> {
    Some(match place {
        Block::Encoder(4) => (Domain::Apb2, 1),
        Block::Encoder(i) => (Domain::Apb1, i as u32),
        Block::Usart => (Domain::Apb1, 15 + u32::from(usart)),
        Block::Power => (Domain::Apb1, 28),
        Block::Pwm => (Domain::Apb2, 0),
        Block::Adc => (Domain::Apb2, 8),
        Block::Syscfg => (Domain::Apb2, 14),
        Block::Capture => (Domain::Apb2, 18),
        Block::Port(i) => (Domain::Ahb1, i as u32),
        Block::Dma => (Domain::Ahb1, 21),
        Block::Iwdg | Block::Exti | Block::Rcc | Block::Flash | Block::Debug => return None,
    })
}

/// Whether an access of this width is allowed (2.3, and each chapter's opening).
fn width_allowed(place: Block, bytes: u32) -> bool {
    match place {
        Block::Port(_) | Block::Rcc => true,
        Block::Encoder(_) | Block::Pwm | Block::Capture | Block::Usart | Block::Iwdg | Block::Power => {
            bytes >= 2
        }
        _ => bytes == 4,
    }
}

impl Bus {
    /// Reads a register of the chip or of the core.
    pub(crate) fn read_register(&mut self, address: u32, bytes: u32) -> Result<u32, Trap> {
        if address >> 20 == 0xe00 && address & !0x3ff != 0xe004_2000 {
            return self.read_system(address, bytes);
        }
        let Some((place, base)) = place(address, self.wiring.usart) else {
            return Err(self.nothing_at(address, Violation::Unmapped(address)));
        };
        if self.now >= self.deadline {
            self.advance();
        }
        let (word, shift) = (address & !3, 8 * (address & 3));
        let offset = word - base;
        if !width_allowed(place, bytes) {
            return Err(Violation::Width { address, bytes }.into());
        }
        let _ = self.bits(place, offset).ok_or(Violation::UnknownRegister(address))?;
        if !self.has_clock(place, address)? {
            return Ok(0);
        }
        let value = match self.hidden {
            Some((hidden, value)) if hidden == word => value,
            _ => self.read_place(place, offset),
        } >> shift;
        Ok(if bytes == 4 { value } else { value & ((1 << (8 * bytes)) - 1) })
    }

    /// Writes a register of the chip or of the core.
    pub(crate) fn write_register(&mut self, address: u32, bytes: u32, value: u32) -> Result<(), Trap> {
        self.touched = true;
        if address >> 20 == 0xe00 && address & !0x3ff != 0xe004_2000 {
            if self.is_lost(address, value) {
                return Ok(());
            }
            return self.write_system(address, bytes, value);
        }
        let Some((place, base)) = place(address, self.wiring.usart) else {
            return Err(self.nothing_at(address, Violation::Unmapped(address)));
        };
        if self.now >= self.deadline {
            self.advance();
        }
        if !width_allowed(place, bytes) || (bytes < 4 && !matches!(place, Block::Port(_)) && address & 3 != 0)
        {
            return Err(Violation::Width { address, bytes }.into());
        }
        let (word, shift) = (address & !3, 8 * (address & 3));
        let offset = word - base;
        let bits = self.bits(place, offset).ok_or(Violation::UnknownRegister(address))?;
        let value = if bytes == 4 {
            value
        } else if let Block::Port(i) = place {
            // The other bytes keep what they have; those of BSRR are not kept, but zero.
            let mask = ((1u32 << (8 * bytes)) - 1) << shift;
            let old = if offset == 0x18 { 0 } else { self.ports[i].read(offset, 0, 0) };
            old & !mask | value << shift & mask
        } else {
            value & ((1 << (8 * bytes)) - 1)
        };
        if self.is_lost(address, value) {
            return Ok(());
        }
        if !self.has_clock(place, address)? && self.rules.early_is_lost {
            return Ok(());
        }
        self.check_bits(address, bits, value)?;
        self.write_place(place, offset, value & bits.writable)?;
        if place == Block::Rcc {
            self.hclk_may_have_changed();
            self.check_wait_states()?;
        }
        self.refresh();
        Ok(())
    }

    /// Whether this write is lost by fault injection.
    fn is_lost(&mut self, address: u32, value: u32) -> bool {
        let lost = self.lost_write == Some(address);
        if lost {
            self.lost_write = None;
            self.hidden = self.lost_write_is_hidden.then_some((address, value));
        }
        lost
    }

    fn check_bits(&mut self, address: u32, bits: Bits, value: u32) -> Result<(), Trap> {
        let reserved = !(bits.writable | bits.read_only);
        let wrong = (value ^ bits.reserved_ones) & reserved;
        if wrong != 0 {
            self.tolerate(self.rules.reserved_bits, Violation::ReservedBits { address, bits: wrong })?;
        }
        let ones = value & bits.read_only;
        if ones != 0 {
            self.tolerate(self.rules.read_only_bits, Violation::ReadOnlyBits { address, bits: ones })?;
        }
        Ok(())
    }

    /// Whether the peripheral's clock has been enabled for long enough; if it is off, the run ends.
    fn has_clock(&mut self, place: Block, address: u32) -> Result<bool, Trap> {
        let Some((domain, bit)) = clock(place, self.wiring.usart) else { return Ok(true) };
        let Some(at) = self.rcc.usable_at(domain, bit) else {
            return Err(Violation::NoClock(address).into());
        };
        if self.now >= at {
            return Ok(true);
        }
        let cycles = (at - self.now).div_ceil(self.hclk) as u32;
        self.tolerate(self.rules.early, Violation::Early { address, cycles })?;
        Ok(false)
    }

    fn bits(&self, place: Block, offset: u32) -> Option<Bits> {
        match place {
            Block::Encoder(i) => self.encoders[i].bits(offset),
            Block::Iwdg => Iwdg::bits(offset),
            Block::Usart => Usart::bits(offset),
            Block::Power => self.power.bits(offset),
            Block::Pwm => self.pwm.bits(offset),
            Block::Adc => Adc::bits(offset),
            Block::Syscfg => Exti::configuration_bits(offset),
            Block::Exti => Exti::bits(offset),
            Block::Capture => CaptureTimer::bits(offset),
            Block::Port(i) => self.ports.get(i)?.bits(offset),
            Block::Rcc => self.rcc.bits(offset),
            // FLASH_ACR (3.9.1), FLASH_OPTCR (3.9.10).
            Block::Flash => match offset {
                0x00 => Some(Bits::writable(0x1f07)),
                0x14 => Some(Bits::writable(0).with_read_only(u32::MAX)),
                _ => None,
            },
            Block::Dma => Dma::bits(offset),
            // DBGMCU (38.16).
            Block::Debug => match offset {
                0x00 => Some(Bits::writable(0).with_read_only(u32::MAX)),
                0x04 => Some(Bits::writable(0xe7)),
                0x08 => Some(Bits::writable(0x06e0_1dff)),
                0x0c => Some(Bits::writable(0x0007_0003)),
                _ => None,
            },
        }
    }

    fn read_place(&mut self, place: Block, offset: u32) -> u32 {
        let now = self.now;
        match place {
            Block::Encoder(i) => {
                self.unstable |= offset == 0x24;
                let (shaft, tick) = self.encoder_route(i);
                self.encoders[i].read(offset, shaft.as_ref(), now, tick)
            }
            Block::Iwdg => self.iwdg.read(offset),
            Block::Usart => {
                let value = self.usart.read(offset);
                if offset == 4 {
                    self.touched = true;
                    self.refresh();
                }
                value
            }
            Block::Power => self.power.read(offset),
            Block::Pwm => {
                self.unstable = true;
                self.settle_output();
                self.pwm.read(offset)
            }
            Block::Adc => {
                self.touched |= offset == 0x4c;
                self.adc.read(offset)
            }
            Block::Syscfg => self.exti.read_configuration(offset),
            Block::Exti => self.exti.read(offset),
            Block::Capture => {
                self.unstable |= offset == 0x24;
                self.touched |= offset == 0x34;
                let tick = self.rcc.timer_clock(Domain::Apb2);
                self.capture.read(offset, now, tick)
            }
            Block::Port(i) => {
                self.unstable |= offset == 0x10;
                let noise = self.random() as u32;
                let levels = self.alternate_levels(i);
                self.ports[i].read(offset, levels, noise)
            }
            Block::Rcc => self.rcc.read(offset),
            Block::Flash if offset == 0 => self.flash_control,
            Block::Flash => self.power.brown_out.option_control(),
            Block::Dma => self.dma.read(offset),
            Block::Debug if offset == 0 => self.chip.identity(),
            Block::Debug => self.debug_freeze.registers[offset as usize / 4 - 1],
        }
    }

    fn write_place(&mut self, place: Block, offset: u32, value: u32) -> Result<(), Violation> {
        let now = self.now;
        match place {
            Block::Encoder(i) => {
                let (shaft, tick) = self.encoder_route(i);
                self.encoders[i].write(offset, value, shaft.as_ref(), now, tick)?;
            }
            Block::Iwdg => self.iwdg.write(offset, value, now)?,
            Block::Usart => {
                let apb1 = self.rcc.pclk(Domain::Apb1);
                self.usart.write(offset, value, now, apb1)?;
                self.move_by_dma();
            }
            Block::Power => {
                self.power.write(offset, value);
                self.supply_changed();
            }
            Block::Pwm => {
                self.settle_output();
                self.pwm.write(offset, value, now)?;
            }
            Block::Adc => {
                let apb2 = self.rcc.pclk(Domain::Apb2);
                self.adc.write(offset, value, now, apb2)?;
            }
            Block::Syscfg => self.exti.write_configuration(offset, value),
            Block::Exti => self.exti.write(offset, value),
            Block::Capture => self.capture.write(offset, value, now)?,
            Block::Port(i) => {
                self.settle_output();
                self.ports[i].write(offset, value)?;
                self.angle_sensors_hear()?;
                self.levels_changed();
            }
            Block::Rcc => {
                self.settle_output();
                self.rcc.write(offset, value, now)?;
            }
            Block::Flash => {
                self.flash_control = value;
                self.cache.configure(value);
                self.check_wait_states()?;
            }
            Block::Dma => {
                self.dma.write(offset, value)?;
                self.move_by_dma();
            }
            Block::Debug => {
                if offset >= 8 && value & !super::FREEZES_WATCHDOG != 0 {
                    return Err(Violation::NotModelled("freezing a timer other than the watchdog"));
                }
                self.debug_freeze.registers[offset as usize / 4 - 1] = value;
            }
        }
        Ok(())
    }

    fn hclk_may_have_changed(&mut self) {
        let hclk = self.rcc.hclk();
        if hclk != self.hclk {
            self.system.change_clock(self.now, self.hclk, hclk);
            self.hclk = hclk;
        }
    }

    /// One wait state for each 30 MHz at 2.7 V and above, for fewer MHz below (3.5.1).
    pub(crate) fn check_wait_states(&self) -> Result<(), Violation> {
        let hz = crate::clock::frequency(self.rcc.hclk());
        let needed = hz.saturating_sub(1) / self.power.hz_per_wait_state();
        let set = self.flash_control & 7;
        if set < needed { Err(Violation::WaitStates(set)) } else { Ok(()) }
    }

    fn read_system(&mut self, address: u32, bytes: u32) -> Result<u32, Trap> {
        self.unstable |= matches!(address, 0xe000_1004 | 0xe000_e018);
        match bytes {
            4 => self.system.read(address, self.now, self.hclk),
            1 => {
                let byte = self.system.nvic.read_byte(address);
                byte.map(u32::from).ok_or(Violation::Width { address, bytes }.into())
            }
            _ => Err(Violation::Width { address, bytes }.into()),
        }
    }

    fn write_system(&mut self, address: u32, bytes: u32, value: u32) -> Result<(), Trap> {
        match bytes {
            4 => self.system.write(address, value, self.now, self.hclk)?,
            1 if self.system.nvic.write_byte(address, value as u8) => {}
            _ => return Err(Violation::Width { address, bytes }.into()),
        }
        self.refresh();
        Ok(())
    }
}
