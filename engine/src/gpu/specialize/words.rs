//! Modules as words, and the numbers that the specification gives to opcodes and decorations.

/// Opcodes and decorations, as the specification numbers them.
pub(super) mod op {
    pub const NAME: u32 = 5;
    pub const LINE: u32 = 8;
    pub const TYPE_VOID: u32 = 19;
    pub const TYPE_BOOL: u32 = 20;
    pub const TYPE_INT: u32 = 21;
    pub const TYPE_LAST: u32 = 39;
    pub const CONSTANT_TRUE: u32 = 41;
    pub const CONSTANT_FALSE: u32 = 42;
    pub const CONSTANT: u32 = 43;
    pub const CONSTANT_COMPOSITE: u32 = 44;
    pub const SPEC_TRUE: u32 = 48;
    pub const SPEC_FALSE: u32 = 49;
    pub const SPEC: u32 = 50;
    pub const SPEC_COMPOSITE: u32 = 51;
    pub const SPEC_OP: u32 = 52;
    pub const FUNCTION: u32 = 54;
    pub const FUNCTION_END: u32 = 56;
    pub const DECORATE: u32 = 71;
    pub const DECORATION_GROUP: u32 = 73;
    pub const GROUP_DECORATE: u32 = 74;
    pub const GROUP_MEMBER_DECORATE: u32 = 75;
    pub const DECORATE_ID: u32 = 332;
    pub const DECORATE_STRING: u32 = 5632;
    pub const I_ADD: u32 = 128;
    pub const I_SUB: u32 = 130;
    pub const I_MUL: u32 = 132;
    pub const U_DIV: u32 = 134;
    pub const U_MOD: u32 = 137;
    pub const LOGICAL_EQUAL: u32 = 164;
    pub const LOGICAL_NOT_EQUAL: u32 = 165;
    pub const LOGICAL_OR: u32 = 166;
    pub const LOGICAL_AND: u32 = 167;
    pub const LOGICAL_NOT: u32 = 168;
    pub const SELECT: u32 = 169;
    pub const I_EQUAL: u32 = 170;
    pub const I_NOT_EQUAL: u32 = 171;
    pub const U_GREATER: u32 = 172;
    pub const S_GREATER: u32 = 173;
    pub const U_GREATER_EQUAL: u32 = 174;
    pub const S_GREATER_EQUAL: u32 = 175;
    pub const U_LESS: u32 = 176;
    pub const S_LESS: u32 = 177;
    pub const U_LESS_EQUAL: u32 = 178;
    pub const S_LESS_EQUAL: u32 = 179;
    pub const SHIFT_RIGHT: u32 = 194;
    pub const SHIFT_LEFT: u32 = 196;
    pub const BIT_OR: u32 = 197;
    pub const BIT_XOR: u32 = 198;
    pub const BIT_AND: u32 = 199;
    pub const BIT_NOT: u32 = 200;
    pub const PHI: u32 = 245;
    pub const LOOP_MERGE: u32 = 246;
    pub const SELECTION_MERGE: u32 = 247;
    pub const LABEL: u32 = 248;
    pub const BRANCH: u32 = 249;
    pub const BRANCH_CONDITIONAL: u32 = 250;
    pub const SWITCH: u32 = 251;
    #[cfg(test)]
    pub const RETURN: u32 = 253;
    pub const UNREACHABLE: u32 = 255;
    pub const NO_LINE: u32 = 317;
    pub const TERMINATE_INVOCATION: u32 = 4416;
    pub const TYPE_RAY_QUERY: u32 = 4472;
    pub const TYPE_ACCELERATION_STRUCTURE: u32 = 5341;

    pub const DECORATION_SPEC_ID: u32 = 1;
}

pub(super) const MAGIC: u32 = 0x0723_0203;
/// Words before the first instruction.
pub(super) const HEADER: usize = 5;

/// An instruction: its words, the first of them opcode and length.
pub(super) type Words<'a> = &'a [u32];

pub(super) fn opcode(words: Words<'_>) -> u32 {
    words[0] & 0xFFFF
}

pub(super) fn first_word(op: u32, length: usize) -> u32 {
    (length as u32) << 16 | op
}

/// The instructions of words behind the header; `None` where lengths do not fit.
pub(super) fn split(mut words: &[u32]) -> Option<Vec<Words<'_>>> {
    let mut instructions = Vec::new();
    while let Some(first) = words.first() {
        let length = (first >> 16) as usize;
        if length == 0 || length > words.len() {
            return None;
        }
        let (instruction, rest) = words.split_at(length);
        instructions.push(instruction);
        words = rest;
    }
    Some(instructions)
}
