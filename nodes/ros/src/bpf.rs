//! Programs for the kernel's packet filter: its instructions with labels instead of distances.

use socket2::SockFilter;

const LD: u16 = 0x00;
const LDX: u16 = 0x01;
const ST: u16 = 0x02;
const ALU: u16 = 0x04;
const JMP: u16 = 0x05;
const RET: u16 = 0x06;

const IMM: u16 = 0x00;
const ABS: u16 = 0x20;
const IND: u16 = 0x40;
const MEM: u16 = 0x60;
const LEN: u16 = 0x80;
const BY_INDEX: u16 = 0x08;

const ADD: u16 = 0x00;
const SUB: u16 = 0x10;
const MUL: u16 = 0x20;
const AND: u16 = 0x50;
const RSH: u16 = 0x70;

const JA: u16 = 0x00;
const JEQ: u16 = 0x10;
const JGT: u16 = 0x20;
const JSET: u16 = 0x40;

/// How much is loaded.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Size {
    /// A byte.
    Byte,
    /// Two bytes, the upper one first.
    Half,
    /// Four bytes, the uppermost one first.
    Word,
}

/// A place in a program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Label(usize);

impl Label {
    /// The instruction that follows.
    pub(crate) const NEXT: Self = Self(usize::MAX);
}

/// A program in the making.
///
/// It has an accumulator, an index and some places of memory; what is loaded "at" a place lies that far behind the index.
#[derive(Debug, Default)]
pub(crate) struct Program {
    steps: Vec<Step>,
    places: Vec<usize>,
}

#[derive(Debug)]
struct Step {
    code: u16,
    value: u32,
    yes: Label,
    no: Label,
}

impl Program {
    /// A label that has no place yet.
    pub(crate) fn label(&mut self) -> Label {
        self.places.push(usize::MAX);
        Label(self.places.len() - 1)
    }

    /// Several of them.
    pub(crate) fn labels<const N: usize>(&mut self) -> [Label; N] {
        std::array::from_fn(|_| self.label())
    }

    /// The label stands for what follows.
    pub(crate) fn place(&mut self, label: Label) {
        let here = self.steps.len();
        if let Some(place) = self.places.get_mut(label.0) {
            *place = here;
        }
    }

    fn push(&mut self, code: u16, value: u32) {
        self.steps.push(Step { code, value, yes: Label::NEXT, no: Label::NEXT });
    }

    fn branch(&mut self, test: u16, value: u32, yes: Label, no: Label) {
        self.steps.push(Step { code: JMP | test, value, yes, no });
    }

    /// Loads from a place of the packet.
    pub(crate) fn load(&mut self, size: Size, from: u32) {
        self.push(LD | ABS | size.code(), from);
    }

    /// Loads from a place behind the index; a packet that ends before it is dropped.
    pub(crate) fn load_at(&mut self, size: Size, at: u32) {
        self.push(LD | IND | size.code(), at);
    }

    /// Loads the length of the packet.
    pub(crate) fn load_length(&mut self) {
        self.push(LD | LEN, 0);
    }

    /// Loads a number.
    pub(crate) fn set(&mut self, value: u32) {
        self.push(LD | IMM, value);
    }

    /// Stores the accumulator.
    pub(crate) fn keep(&mut self, place: u32) {
        self.push(ST, place);
    }

    /// Loads what was stored.
    pub(crate) fn load_kept(&mut self, place: u32) {
        self.push(LD | MEM, place);
    }

    /// Loads the index from memory.
    pub(crate) fn index(&mut self, place: u32) {
        self.push(LDX | MEM, place);
    }

    /// Adds a number.
    pub(crate) fn add(&mut self, value: u32) {
        self.push(ALU | ADD, value);
    }

    /// Adds the index.
    pub(crate) fn add_index(&mut self) {
        self.push(ALU | ADD | BY_INDEX, 0);
    }

    /// Subtracts the index.
    pub(crate) fn subtract_index(&mut self) {
        self.push(ALU | SUB | BY_INDEX, 0);
    }

    /// Turns the two lower bytes over, whatever the upper ones are.
    pub(crate) fn turn_over(&mut self) {
        self.push(ALU | AND, 0xffff);
        self.push(ALU | MUL, 0x0001_0001);
        self.push(ALU | RSH, 8);
        self.push(ALU | AND, 0xffff);
    }

    /// Keeps only these bits.
    pub(crate) fn mask(&mut self, bits: u32) {
        self.push(ALU | AND, bits);
    }

    /// Shifts to the right.
    pub(crate) fn shift_right(&mut self, bits: u32) {
        self.push(ALU | RSH, bits);
    }

    /// Goes on elsewhere.
    pub(crate) fn jump(&mut self, to: Label) {
        self.branch(JA, 0, to, to);
    }

    /// Goes where it is said for numbers that are equal, and for others.
    pub(crate) fn branch_equal(&mut self, value: u32, yes: Label, no: Label) {
        self.branch(JEQ, value, yes, no);
    }

    /// The same by the index.
    pub(crate) fn branch_equal_to_index(&mut self, yes: Label, no: Label) {
        self.branch(JEQ | BY_INDEX, 0, yes, no);
    }

    /// The same for numbers that are greater.
    pub(crate) fn branch_greater(&mut self, value: u32, yes: Label, no: Label) {
        self.branch(JGT, value, yes, no);
    }

    /// The same by the index.
    pub(crate) fn branch_greater_than_index(&mut self, yes: Label, no: Label) {
        self.branch(JGT | BY_INDEX, 0, yes, no);
    }

    /// The same for numbers that have one of the bits.
    pub(crate) fn branch_bits(&mut self, bits: u32, yes: Label, no: Label) {
        self.branch(JSET, bits, yes, no);
    }

    /// The packet passes.
    pub(crate) fn accept(&mut self) {
        self.push(RET, u32::MAX);
    }

    /// The packet is dropped.
    pub(crate) fn drop_it(&mut self) {
        self.push(RET, 0);
    }

    /// Memory that the kernel takes for it [B]: a step has 8, an access to the packet becomes eight of its own.
    #[cfg(test)]
    pub(crate) fn kernel_bytes(&self) -> usize {
        let accesses = self.steps.iter().filter(|step| step.code & 0xe7 == LD | IND).count();
        8 * self.steps.len() + 56 * accesses
    }

    /// The program as the kernel takes it; nothing if it jumps too far or has too many instructions.
    pub(crate) fn finish(&self) -> Option<Vec<SockFilter>> {
        /// The kernel takes no more.
        const LONGEST: usize = 4096;
        let distance = |from: usize, to: Label| match to {
            Label::NEXT => Some(0),
            Label(label) => self.places.get(label)?.checked_sub(from + 1),
        };
        let steps = self.steps.iter().enumerate().map(|(here, step)| {
            let (yes, no) = (distance(here, step.yes)?, distance(here, step.no)?);
            if step.code == JMP | JA {
                return Some(SockFilter::new(step.code, 0, 0, u32::try_from(yes).ok()?));
            }
            Some(SockFilter::new(step.code, u8::try_from(yes).ok()?, u8::try_from(no).ok()?, step.value))
        });
        let steps: Vec<SockFilter> = steps.collect::<Option<_>>()?;
        (steps.len() <= LONGEST).then_some(steps)
    }
}

impl Size {
    const fn code(self) -> u16 {
        match self {
            Self::Word => 0x00,
            Self::Half => 0x08,
            Self::Byte => 0x10,
        }
    }
}
