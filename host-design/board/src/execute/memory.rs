//! Loads and stores of more than one register, exclusive accesses and table branches.

use crate::error::{Done, ProcessorFault};
use crate::instruction::{Addressing, Op, Unit};
use crate::machine::Microcontroller;

impl Microcontroller {
    /// Address of an access, and the new base if it is written back.
    #[inline]
    fn place(&self, rn: u8, place: Addressing) -> (u32, Option<u32>) {
        let base = self.registers.get(rn);
        match place {
            Addressing::Offset(offset) => (base.wrapping_add_signed(offset), None),
            Addressing::Indexed { register, shift } => {
                (base.wrapping_add(self.registers.get(register) << shift), None)
            }
            Addressing::PreIndexed(offset) => {
                let address = base.wrapping_add_signed(offset.into());
                (address, Some(address))
            }
            Addressing::PostIndexed(offset) => (base, Some(base.wrapping_add_signed(offset.into()))),
        }
    }

    #[inline]
    pub(super) fn load_single(
        &mut self,
        unit: Unit,
        rt: u8,
        rn: u8,
        place: Addressing,
        loaded: bool,
    ) -> Done {
        let (address, base) = self.place(rn, place);
        // Consecutive loads overlap in the pipeline.
        self.cycles += u32::from(!loaded);
        let value = self.load(address, unit)?;
        if let Some(base) = base {
            self.registers.set(rn, base);
        }
        self.loaded = self.may_overlap(loaded);
        self.load_into(rt, value)
    }

    #[inline]
    pub(super) fn load_into(&mut self, rt: u8, value: u32) -> Done {
        if rt == 15 {
            return self.interwork(value);
        }
        self.registers.set(rt, value);
        Ok(())
    }

    #[inline]
    pub(super) fn store_single(&mut self, unit: Unit, rt: u8, rn: u8, place: Addressing) -> Done {
        let (address, base) = self.place(rn, place);
        self.store(address, unit, self.registers.get(rt))?;
        if let Some(base) = base {
            self.registers.set(rn, base);
        }
        Ok(())
    }

    pub(super) fn memory(&mut self, op: Op) -> Done {
        match op {
            Op::LoadDual { rt, rt2, rn, offset, index, write_back } => {
                let (address, base) = self.dual(rn, offset, index)?;
                let first = self.load(address, Unit::Word)?;
                let second = self.load(address.wrapping_add(4), Unit::Word)?;
                self.registers.set(rt, first);
                self.registers.set(rt2, second);
                self.write_back(rn, base, write_back);
                self.cycles += 2;
            }
            Op::StoreDual { rt, rt2, rn, offset, index, write_back } => {
                let (address, base) = self.dual(rn, offset, index)?;
                self.store(address, Unit::Word, self.registers.get(rt))?;
                self.store(address.wrapping_add(4), Unit::Word, self.registers.get(rt2))?;
                self.write_back(rn, base, write_back);
                self.cycles += 2;
            }
            Op::LoadMultiple { rn, list, down, write_back } => {
                return self.load_multiple(rn, list, down, write_back);
            }
            Op::StoreMultiple { rn, list, down, write_back } => {
                return self.store_multiple(rn, list, down, write_back);
            }
            Op::LoadExclusive { unit, rt, rn, offset } => {
                let address = self.registers.get(rn).wrapping_add(offset.into());
                self.aligned(address, unit)?;
                let value = self.load(address, unit)?;
                self.exclusive = true;
                self.registers.set(rt, value);
                self.cycles += 1;
            }
            Op::StoreExclusive { unit, rd, rt, rn, offset } => {
                let address = self.registers.get(rn).wrapping_add(offset.into());
                self.aligned(address, unit)?;
                let stores = std::mem::take(&mut self.exclusive);
                if stores {
                    self.store(address, unit, self.registers.get(rt))?;
                }
                self.registers.set(rd, u32::from(!stores));
                self.cycles += 1;
            }
            Op::TableBranch { rn, rm, half } => {
                let (base, index) = (self.registers.get(rn), self.registers.get(rm));
                let steps = if half {
                    self.load(base.wrapping_add(index << 1), Unit::Half)?
                } else {
                    self.load(base.wrapping_add(index), Unit::Byte)?
                };
                self.cycles += 1;
                self.branch(self.registers.r[15].wrapping_add(2 * steps));
            }
            _ => unreachable!("only these are sent here"),
        }
        Ok(())
    }

    /// Address of two words and the new base; the program counter as base is rounded down to a multiple of four.
    fn dual(&self, rn: u8, offset: i16, index: bool) -> Result<(u32, u32), crate::error::Trap> {
        let base = if rn == 15 { self.registers.r[15] & !3 } else { self.registers.get(rn) };
        let moved = base.wrapping_add_signed(offset.into());
        let address = if index { moved } else { base };
        self.aligned(address, Unit::Word)?;
        Ok((address, moved))
    }

    /// First address of a block of `count` words, and the base after it.
    fn block(&self, rn: u8, count: u32, down: bool) -> Result<(u32, u32), crate::error::Trap> {
        let base = self.registers.get(rn);
        self.aligned(base, Unit::Word)?;
        let bytes = 4 * count;
        Ok(if down {
            (base.wrapping_sub(bytes), base.wrapping_sub(bytes))
        } else {
            (base, base.wrapping_add(bytes))
        })
    }

    fn write_back(&mut self, rn: u8, base: u32, write_back: bool) {
        if write_back {
            self.registers.set(rn, base);
        }
    }

    /// Faults for an unaligned address, in accesses that must be aligned (A3.2.1).
    fn aligned(&self, address: u32, unit: Unit) -> Done {
        if address & (unit.bytes() - 1) != 0 { Err(ProcessorFault::Unaligned.into()) } else { Ok(()) }
    }

    fn store_multiple(&mut self, rn: u8, list: u16, down: bool, write_back: bool) -> Done {
        let (mut address, base) = self.block(rn, list.count_ones(), down)?;
        for register in 0..15 {
            if list >> register & 1 != 0 {
                self.store(address, Unit::Word, self.registers.get(register))?;
                address = address.wrapping_add(4);
            }
        }
        self.write_back(rn, base, write_back);
        self.cycles += list.count_ones();
        Ok(())
    }

    fn load_multiple(&mut self, rn: u8, list: u16, down: bool, write_back: bool) -> Done {
        let (mut address, base) = self.block(rn, list.count_ones(), down)?;
        let mut values = [0; 16];
        for (register, value) in values.iter_mut().enumerate() {
            if list >> register & 1 != 0 {
                *value = self.load(address, Unit::Word)?;
                address = address.wrapping_add(4);
            }
        }
        self.write_back(rn, base, write_back);
        self.cycles += list.count_ones();
        for (register, &value) in values.iter().enumerate().take(15) {
            if list >> register & 1 != 0 {
                self.registers.set(register as u8, value);
            }
        }
        if list >> 15 != 0 { self.interwork(values[15]) } else { Ok(()) }
    }

    /// Loads and stores of floating-point registers.
    pub(super) fn float_memory(&mut self, op: Op) -> Done {
        match op {
            Op::FloatLoad { d, rn, offset, count } => {
                let (address, _) = self.dual(rn, offset, true)?;
                for i in 0..count {
                    let value = self.load(address.wrapping_add(4 * u32::from(i)), Unit::Word)?;
                    self.registers.set_single(d + i, value);
                }
                self.cycles += u32::from(count);
            }
            Op::FloatStore { d, rn, offset, count } => {
                let (address, _) = self.dual(rn, offset, true)?;
                for i in 0..count {
                    let value = self.registers.single(d + i);
                    self.store(address.wrapping_add(4 * u32::from(i)), Unit::Word, value)?;
                }
                self.cycles += u32::from(count);
            }
            Op::FloatLoadMultiple { d, rn, count, down, write_back } => {
                let (address, base) = self.block(rn, count.into(), down)?;
                for i in 0..count {
                    let value = self.load(address.wrapping_add(4 * u32::from(i)), Unit::Word)?;
                    self.registers.set_single(d + i, value);
                }
                self.write_back(rn, base, write_back);
                self.cycles += u32::from(count);
            }
            Op::FloatStoreMultiple { d, rn, count, down, write_back } => {
                let (address, base) = self.block(rn, count.into(), down)?;
                for i in 0..count {
                    let value = self.registers.single(d + i);
                    self.store(address.wrapping_add(4 * u32::from(i)), Unit::Word, value)?;
                }
                self.write_back(rn, base, write_back);
                self.cycles += u32::from(count);
            }
            _ => unreachable!("only these are sent here"),
        }
        Ok(())
    }
}
