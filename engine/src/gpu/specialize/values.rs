//! Types, constants with their values, and expressions of these.

use std::collections::{HashMap, HashSet};

use super::Why;
use super::words::{Words, first_word, op, opcode};

/// Ids of values of 32 bits that are known, truth values as 0 and 1.
pub(super) type Known = HashMap<u32, u32>;

/// What stands before functions.
#[derive(Default)]
pub(super) struct Globals {
    /// Instructions, with specialization constants as constants.
    pub instructions: Vec<Vec<u32>>,
    /// Values of constants.
    pub known: Known,
    /// Ids of types.
    pub types: HashSet<u32>,
    /// Integers of 64 bits are among the types: literals of a switch over these are of two words.
    pub has_long_ints: bool,
    bools: HashSet<u32>,
    /// Integers of 32 bits.
    ints: HashSet<u32>,
    /// Expressions without a value, and composites that have such parts, stay what they are.
    open: HashSet<u32>,
    /// Numbers of specialization constants in the interface, by their ids.
    numbers: HashMap<u32, u32>,
}

impl Globals {
    /// With these values of constants by their numbers in the interface, and defaults where none is given.
    pub fn with_values(global: &[Words<'_>], values: &[(u32, u32)]) -> Result<Self, Why> {
        let mut globals = Self::default();
        for words in global {
            match opcode(words) {
                op::DECORATION_GROUP | op::GROUP_DECORATE | op::GROUP_MEMBER_DECORATE => {
                    return Err("it decorates by groups");
                }
                op::DECORATE if words.len() == 4 && words[2] == op::DECORATION_SPEC_ID => {
                    globals.numbers.insert(words[1], words[3]);
                }
                op::TYPE_VOID..=op::TYPE_LAST | op::TYPE_RAY_QUERY | op::TYPE_ACCELERATION_STRUCTURE => {
                    globals.add_type(words);
                    globals.instructions.push(words.to_vec());
                }
                _ => {
                    let written = globals.constant(words, values);
                    globals.instructions.push(written);
                }
            }
        }
        Ok(globals)
    }

    fn add_type(&mut self, words: Words<'_>) {
        let id = words[1];
        self.types.insert(id);
        match (opcode(words), words.get(2)) {
            (op::TYPE_BOOL, _) => {
                self.bools.insert(id);
            }
            (op::TYPE_INT, Some(32)) => {
                self.ints.insert(id);
            }
            (op::TYPE_INT, Some(64)) => self.has_long_ints = true,
            _ => {}
        }
    }

    /// The instruction as it is written, a constant's with its value, which is known from here on.
    fn constant(&mut self, words: Words<'_>, values: &[(u32, u32)]) -> Vec<u32> {
        let given = |id: u32| {
            let number = self.numbers.get(&id)?;
            values
                .iter()
                .find(|(other, _)| other == number)
                .map(|(_, value)| *value)
        };
        let mut written = words.to_vec();
        match opcode(words) {
            op::CONSTANT_TRUE | op::CONSTANT_FALSE => {
                self.known
                    .insert(words[2], u32::from(opcode(words) == op::CONSTANT_TRUE));
            }
            op::CONSTANT if self.ints.contains(&words[1]) => {
                self.known.insert(words[2], words[3]);
            }
            op::SPEC_TRUE | op::SPEC_FALSE => {
                let own = u32::from(opcode(words) == op::SPEC_TRUE);
                let value = given(words[2]).unwrap_or(own) != 0;
                self.known.insert(words[2], value.into());
                written = truth(words[1], words[2], value);
            }
            op::SPEC => {
                written[0] = first_word(op::CONSTANT, words.len());
                if words.len() == 4 {
                    written[3] = given(words[2]).unwrap_or(words[3]);
                }
                if self.ints.contains(&words[1]) {
                    self.known.insert(words[2], written[3]);
                }
            }
            op::SPEC_OP => {
                let (is_bool, is_int) = (self.bools.contains(&words[1]), self.ints.contains(&words[1]));
                match evaluate(words[3], &words[4..], &self.known).filter(|_| is_bool || is_int) {
                    Some(value) => {
                        self.known.insert(words[2], value);
                        written = if is_bool {
                            truth(words[1], words[2], value != 0)
                        } else {
                            vec![first_word(op::CONSTANT, 4), words[1], words[2], value]
                        };
                    }
                    None => {
                        self.open.insert(words[2]);
                    }
                }
            }
            op::SPEC_COMPOSITE => {
                if words[3..].iter().any(|part| self.open.contains(part)) {
                    self.open.insert(words[2]);
                } else {
                    written[0] = first_word(op::CONSTANT_COMPOSITE, words.len());
                }
            }
            _ => {}
        }
        written
    }
}

/// The constant of a truth value.
fn truth(ty: u32, id: u32, value: bool) -> Vec<u32> {
    let op = if value { op::CONSTANT_TRUE } else { op::CONSTANT_FALSE };
    vec![first_word(op, 3), ty, id]
}

/// Value of an expression of 32-bit integers or truth values, where it is known.
pub(super) fn evaluate(operation: u32, operands: &[u32], known: &Known) -> Option<u32> {
    let value = |i: usize| operands.get(i).and_then(|id| known.get(id)).copied();
    // One of them may be enough.
    match (operation, value(0), value(1)) {
        (op::LOGICAL_AND, Some(0), _) | (op::LOGICAL_AND, _, Some(0)) => return Some(0),
        (op::LOGICAL_OR, Some(1), _) | (op::LOGICAL_OR, _, Some(1)) => return Some(1),
        (op::SELECT, Some(condition), _) => return value(if condition != 0 { 1 } else { 2 }),
        _ => {}
    }
    let a = value(0)?;
    match operation {
        op::LOGICAL_NOT => return Some(u32::from(a == 0)),
        op::BIT_NOT => return Some(!a),
        _ => {}
    }
    let b = value(1)?;
    let [signed_a, signed_b] = [a, b].map(|value| value as i32);
    let truth = match operation {
        op::LOGICAL_AND | op::LOGICAL_OR | op::BIT_AND | op::BIT_OR | op::BIT_XOR => {
            return Some(match operation {
                op::LOGICAL_AND | op::BIT_AND => a & b,
                op::LOGICAL_OR | op::BIT_OR => a | b,
                _ => a ^ b,
            });
        }
        op::I_ADD => return Some(a.wrapping_add(b)),
        op::I_SUB => return Some(a.wrapping_sub(b)),
        op::I_MUL => return Some(a.wrapping_mul(b)),
        op::U_DIV => return a.checked_div(b),
        op::U_MOD => return a.checked_rem(b),
        op::SHIFT_LEFT => return a.checked_shl(b),
        op::SHIFT_RIGHT => return a.checked_shr(b),
        op::LOGICAL_EQUAL | op::I_EQUAL => a == b,
        op::LOGICAL_NOT_EQUAL | op::I_NOT_EQUAL => a != b,
        op::U_GREATER => a > b,
        op::U_GREATER_EQUAL => a >= b,
        op::U_LESS => a < b,
        op::U_LESS_EQUAL => a <= b,
        op::S_GREATER => signed_a > signed_b,
        op::S_GREATER_EQUAL => signed_a >= signed_b,
        op::S_LESS => signed_a < signed_b,
        op::S_LESS_EQUAL => signed_a <= signed_b,
        _ => return None,
    };
    Some(truth.into())
}
