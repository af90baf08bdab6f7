//! Modules with the values of their specialization constants written in, without the code that these leave out.
//!
//! Kernels hold what every scene may need behind constants. Drivers translate all of it before they drop what the constants exclude, on each start, since their caches
//! hold what comes after: a software driver takes 0.2 s for the shading kernel of a scene of plain surfaces. Here the same is dropped in a pass over the words.
//!
//! What is done: constants get their values, expressions of them too; branches on known conditions become jumps, with the selections that they headed; blocks that
//! nothing reaches are left out, with their places in phi instructions, names and decorations. A block that a structured construct names stays, without content.
//! Nothing is moved, and no operation that stays is changed; arithmetic of floating point is never evaluated. Modules must be valid.
//!
//! Source of the rules: SPIR-V specification 1.3, §2.11 (structured control flow) and §2.4 (logical layout).

use std::collections::{HashMap, HashSet};

/// Opcodes and decorations, as the specification numbers them.
mod op {
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

const MAGIC: u32 = 0x0723_0203;
/// Words before the first instruction.
const HEADER: usize = 5;

/// An instruction: its words, the first of them opcode and length.
type Words<'a> = &'a [u32];

/// Ids of values of 32 bits that are known, truth values as 0 and 1.
type Known = HashMap<u32, u32>;

fn opcode(words: Words<'_>) -> u32 {
    words[0] & 0xFFFF
}

fn first_word(op: u32, length: usize) -> u32 {
    (length as u32) << 16 | op
}

/// A block, with the lines before its label.
struct Block<'a> {
    label: u32,
    words: Vec<Words<'a>>,
}

impl<'a> Block<'a> {
    fn last(&self) -> Words<'a> {
        self.words[self.words.len() - 1]
    }

    /// The merge instruction that stands before the terminator.
    fn merge(&self) -> Option<Words<'a>> {
        let before = self.words.len().checked_sub(2)?;
        let words = self.words[before];
        matches!(opcode(words), op::LOOP_MERGE | op::SELECTION_MERGE).then_some(words)
    }

    fn targets(&self) -> Vec<u32> {
        let words = self.last();
        match opcode(words) {
            op::BRANCH => vec![words[1]],
            op::BRANCH_CONDITIONAL => vec![words[2], words[3]],
            // Selector and default, then literals of one word with their labels.
            op::SWITCH => [words[2]]
                .into_iter()
                .chain(words[3..].chunks(2).map(|pair| pair[pair.len() - 1]))
                .collect(),
            _ => Vec::new(),
        }
    }
}

/// What constants make of a function's control flow.
#[derive(Default)]
struct Flow {
    reached: HashSet<u32>,
    /// From block to block.
    edges: HashSet<(u32, u32)>,
    /// Blocks whose conditional branch is a jump, and where to.
    jumps: HashMap<u32, u32>,
}

/// The module with these values of constants by their ids in the interface, and defaults where none is given; `None` for a module that it cannot do this with, which
/// is sound as it is.
pub(super) fn specialize(module: &[u32], values: &[(u32, u32)]) -> Option<Vec<u32>> {
    if module.first() != Some(&MAGIC) {
        return None;
    }
    let instructions = split(module.get(HEADER..)?)?;
    let mut spec_ids = HashMap::new();
    let mut types = HashSet::new();
    // Literals of a switch over these are of two words.
    let has_long_ints = instructions
        .iter()
        .any(|words| opcode(words) == op::TYPE_INT && words.get(2) == Some(&64));
    for words in &instructions {
        match opcode(words) {
            op::DECORATION_GROUP | op::GROUP_DECORATE | op::GROUP_MEMBER_DECORATE => return None,
            op::SWITCH if has_long_ints => return None,
            op::DECORATE if words.len() == 4 && words[2] == op::DECORATION_SPEC_ID => {
                spec_ids.insert(words[1], words[3]);
            }
            op::TYPE_VOID..=op::TYPE_LAST | op::TYPE_RAY_QUERY | op::TYPE_ACCELERATION_STRUCTURE => {
                types.insert(words[1]);
            }
            _ => {}
        }
    }
    let given = |id: u32| {
        let wanted = spec_ids.get(&id)?;
        values.iter().find(|(id, _)| id == wanted).map(|(_, value)| *value)
    };
    let first_function = instructions
        .iter()
        .position(|words| opcode(words) == op::FUNCTION)
        .unwrap_or(instructions.len());
    let (global, code) = instructions.split_at(first_function);
    let (constants, known) = with_values(global, given);
    let mut body = Vec::with_capacity(module.len());
    let mut gone = HashSet::new();
    for function in code.split_inclusive(|words| opcode(words) == op::FUNCTION_END) {
        write_function(function, &known, &types, &mut body, &mut gone)?;
    }
    let mut out = module[..HEADER].to_vec();
    for words in constants {
        let is_of_removed = matches!(
            opcode(&words),
            op::NAME | op::DECORATE | op::DECORATE_ID | op::DECORATE_STRING
        ) && gone.contains(&words[1]);
        let is_interface = opcode(&words) == op::DECORATE && words[2] == op::DECORATION_SPEC_ID;
        if !is_of_removed && !is_interface {
            out.extend(words);
        }
    }
    out.extend(body);
    Some(out)
}

/// `None` where lengths do not fit.
fn split(mut words: &[u32]) -> Option<Vec<Words<'_>>> {
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

/// What stands before functions, with specialization constants as constants, and the values of all that are known.
fn with_values(global: &[Words<'_>], given: impl Fn(u32) -> Option<u32>) -> (Vec<Vec<u32>>, Known) {
    let mut known = Known::new();
    let mut bools = HashSet::new();
    let mut ints = HashSet::new();
    // Composites that have parts without a value stay what they are.
    let mut open = HashSet::new();
    let mut out = Vec::with_capacity(global.len());
    let truth = |ty: u32, id: u32, value: bool| {
        let op = if value { op::CONSTANT_TRUE } else { op::CONSTANT_FALSE };
        vec![first_word(op, 3), ty, id]
    };
    for words in global {
        let mut written = words.to_vec();
        match opcode(words) {
            op::TYPE_BOOL => {
                bools.insert(words[1]);
            }
            op::TYPE_INT if words[2] == 32 => {
                ints.insert(words[1]);
            }
            op::CONSTANT_TRUE | op::CONSTANT_FALSE => {
                known.insert(words[2], u32::from(opcode(words) == op::CONSTANT_TRUE));
            }
            op::CONSTANT if ints.contains(&words[1]) => {
                known.insert(words[2], words[3]);
            }
            op::SPEC_TRUE | op::SPEC_FALSE => {
                let own = u32::from(opcode(words) == op::SPEC_TRUE);
                let value = given(words[2]).unwrap_or(own) != 0;
                known.insert(words[2], value.into());
                written = truth(words[1], words[2], value);
            }
            op::SPEC => {
                written[0] = first_word(op::CONSTANT, words.len());
                if words.len() == 4 {
                    written[3] = given(words[2]).unwrap_or(words[3]);
                }
                if ints.contains(&words[1]) {
                    known.insert(words[2], written[3]);
                }
            }
            op::SPEC_OP => {
                let is_scalar = bools.contains(&words[1]) || ints.contains(&words[1]);
                match evaluate(words[3], &words[4..], &known).filter(|_| is_scalar) {
                    Some(value) => {
                        known.insert(words[2], value);
                        written = if bools.contains(&words[1]) {
                            truth(words[1], words[2], value != 0)
                        } else {
                            vec![first_word(op::CONSTANT, 4), words[1], words[2], value]
                        };
                    }
                    None => {
                        open.insert(words[2]);
                    }
                }
            }
            op::SPEC_COMPOSITE => {
                if words[3..].iter().any(|part| open.contains(part)) {
                    open.insert(words[2]);
                } else {
                    written[0] = first_word(op::CONSTANT_COMPOSITE, words.len());
                }
            }
            _ => {}
        }
        out.push(written);
    }
    (out, known)
}

/// Value of an expression of 32-bit integers or truth values, where it is known.
fn evaluate(operation: u32, operands: &[u32], known: &Known) -> Option<u32> {
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

/// Writes what is left of a function, and adds the ids that are gone.
fn write_function(
    function: &[Words<'_>],
    known: &Known,
    types: &HashSet<u32>,
    out: &mut Vec<u32>,
    gone: &mut HashSet<u32>,
) -> Option<()> {
    let (head, blocks, end) = blocks_of(function);
    // Branches that have to stay, since what they head would lose its structure.
    let mut kept = HashSet::new();
    let flow = loop {
        let flow = flow_of(&blocks, known, &kept)?;
        let bound = bound_selections(&blocks, &flow);
        if bound.is_empty() {
            break flow;
        }
        kept.extend(bound);
    };
    let is_reached = |block: &&Block<'_>| flow.reached.contains(&block.label);
    let place: HashMap<u32, usize> = blocks.iter().enumerate().map(|(i, block)| (block.label, i)).collect();
    let goes_back = |header: u32| {
        flow.edges
            .iter()
            .any(|(from, to)| *to == header && place[from] >= place[to])
    };
    // Constructs name their merge blocks, and loops where they go on; these must have a way back.
    let mut named = HashSet::new();
    for block in blocks.iter().filter(is_reached) {
        if let Some(merge) = block.merge().filter(|_| !drops_merge(block, &flow)) {
            named.insert(merge[1]);
            if opcode(merge) == op::LOOP_MERGE && !(flow.reached.contains(&merge[2]) && goes_back(block.label)) {
                return None;
            }
        }
    }
    head.iter().for_each(|words| out.extend(*words));
    for block in &blocks {
        if flow.reached.contains(&block.label) {
            write_block(block, &flow, out)?;
            continue;
        }
        let stays = named.contains(&block.label);
        if stays {
            out.extend([first_word(op::LABEL, 2), block.label, first_word(op::UNREACHABLE, 1)]);
        }
        gone.extend(block.words.iter().filter_map(|words| match opcode(words) {
            op::LABEL => (!stays).then_some(words[1]),
            _ if words.len() > 2 && types.contains(&words[1]) => Some(words[2]),
            _ => None,
        }));
    }
    end.iter().for_each(|words| out.extend(*words));
    Some(())
}

/// What stands before the first block, the blocks, and what stands after the last one.
fn blocks_of<'a, 'b>(function: &'b [Words<'a>]) -> (&'b [Words<'a>], Vec<Block<'a>>, &'b [Words<'a>]) {
    let ends_block =
        |words: &Words<'_>| matches!(opcode(words), op::BRANCH..=op::UNREACHABLE | op::TERMINATE_INVOCATION);
    let is_line = |words: &Words<'_>| matches!(opcode(words), op::LINE | op::NO_LINE);
    let label = function.iter().position(|words| opcode(words) == op::LABEL);
    let begin = label.unwrap_or(function.len());
    let (head, mut rest) = function.split_at(begin);
    let mut blocks = Vec::new();
    while let Some(last) = rest.iter().position(ends_block) {
        let (words, after) = rest.split_at(last + 1);
        let own = words.iter().position(|words| !is_line(words)).unwrap_or(0);
        blocks.push(Block {
            label: words[own][1],
            words: words.to_vec(),
        });
        rest = after;
    }
    (head, blocks, rest)
}

/// Follows control flow from the first block. `None` where blocks are not in an order in which one pass tells it.
fn flow_of(blocks: &[Block<'_>], known: &Known, kept: &HashSet<u32>) -> Option<Flow> {
    let place: HashMap<u32, usize> = blocks.iter().enumerate().map(|(i, block)| (block.label, i)).collect();
    let heads_loop = |block: &Block<'_>| block.merge().is_some_and(|merge| opcode(merge) == op::LOOP_MERGE);
    let mut flow = Flow::default();
    let mut known = known.clone();
    flow.reached.extend(blocks.first().map(|block| block.label));
    for (i, block) in blocks.iter().enumerate() {
        let goes_back = |target: &u32| place.get(target).is_none_or(|place| *place <= i);
        let targets = block.targets();
        if targets
            .iter()
            .any(|target| goes_back(target) && place.get(target).is_none_or(|to| !heads_loop(&blocks[*to])))
        {
            return None;
        }
        if !flow.reached.contains(&block.label) {
            continue;
        }
        for words in &block.words {
            if let Some(value) = value_of(words, block.label, &flow, &place, i, &known) {
                known.insert(words[2], value);
            }
        }
        let last = block.last();
        let decided = (opcode(last) == op::BRANCH_CONDITIONAL)
            .then(|| known.get(&last[1]))
            .flatten()
            // A loop keeps its way back.
            .filter(|_| !kept.contains(&block.label) && !targets.iter().any(goes_back));
        let targets = match decided {
            Some(value) => {
                let target = last[if *value != 0 { 2 } else { 3 }];
                flow.jumps.insert(block.label, target);
                vec![target]
            }
            None => targets,
        };
        for target in targets {
            // What is new must come later, or this pass has gone by it.
            if flow.reached.insert(target) && goes_back(&target) {
                return None;
            }
            flow.edges.insert((block.label, target));
        }
    }
    Some(flow)
}

/// Value of an instruction's result, where constants tell it.
fn value_of(
    words: Words<'_>,
    label: u32,
    flow: &Flow,
    place: &HashMap<u32, usize>,
    here: usize,
    known: &Known,
) -> Option<u32> {
    match opcode(words) {
        op::PHI => {
            let mut values = words[3..].chunks(2).filter_map(|pair| {
                let [value, from] = *pair else { return None };
                // What comes later, on the way back of a loop, is not known yet.
                let is_later = place.get(&from).is_none_or(|from| *from >= here);
                (is_later || flow.edges.contains(&(from, label))).then(|| known.get(&value).copied())
            });
            let first = values.next()??;
            values.all(|value| value == Some(first)).then_some(first)
        }
        operation @ (op::I_ADD..=op::BIT_NOT) if words.len() > 3 => evaluate(operation, &words[3..], known),
        _ => None,
    }
}

/// Headers of selections whose branch would become a jump, but that another branch leaves without being a header itself: it would stand in no construct then.
fn bound_selections(blocks: &[Block<'_>], flow: &Flow) -> Vec<u32> {
    let mut merges: HashMap<u32, Vec<u32>> = HashMap::new();
    for block in blocks {
        if let (Some(merge), Some(_)) = (block.merge(), flow.jumps.get(&block.label)) {
            merges.entry(merge[1]).or_default().push(block.label);
        }
    }
    let leaves = blocks.iter().filter(|block| {
        flow.reached.contains(&block.label)
            && opcode(block.last()) == op::BRANCH_CONDITIONAL
            && block.merge().is_none()
            && !flow.jumps.contains_key(&block.label)
    });
    let bound = leaves
        .flat_map(|block| block.targets())
        .filter_map(|target| merges.get(&target));
    bound.flatten().copied().collect()
}

/// Whether a selection goes with the branch that was its condition.
fn drops_merge(block: &Block<'_>, flow: &Flow) -> bool {
    let is_selection = block.merge().is_some_and(|merge| opcode(merge) == op::SELECTION_MERGE);
    is_selection && flow.jumps.contains_key(&block.label)
}

/// `None` for a phi instruction without a place to come from.
fn write_block(block: &Block<'_>, flow: &Flow, out: &mut Vec<u32>) -> Option<()> {
    let jump = flow.jumps.get(&block.label);
    let last = block.words.len() - 1;
    for (i, words) in block.words.iter().enumerate() {
        match (opcode(words), jump) {
            (op::PHI, _) => {
                let pairs = words[3..].chunks(2);
                let left: Vec<u32> = pairs
                    .filter(|pair| flow.edges.contains(&(pair[1], block.label)))
                    .flatten()
                    .copied()
                    .collect();
                if left.is_empty() {
                    return None;
                }
                out.extend([first_word(op::PHI, 3 + left.len()), words[1], words[2]]);
                out.extend(left);
            }
            (op::SELECTION_MERGE, Some(_)) => {}
            (op::BRANCH_CONDITIONAL, Some(target)) if i == last => out.extend([first_word(op::BRANCH, 2), *target]),
            _ => out.extend(*words),
        }
    }
    Some(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::shaders;

    // Ids of the module below.
    const BOOL: u32 = 2;
    const UINT: u32 = 3;
    const FLAG: u32 = 4;
    const COUNT: u32 = 5;
    const IS_THREE: u32 = 6;
    const THREE: u32 = 7;
    const BOUND: u32 = 40;

    fn instruction(op: u32, operands: &[u32]) -> Vec<u32> {
        let mut words = vec![first_word(op, 1 + operands.len())];
        words.extend(operands);
        words
    }

    fn module(parts: &[Vec<u32>]) -> Vec<u32> {
        let header = [MAGIC, 0x0001_0300, 0, BOUND, 0];
        header.into_iter().chain(parts.iter().flatten().copied()).collect()
    }

    /// A flag with the interface id 1, a count with 2, an expression that says whether the count is 3, and a function of these blocks.
    fn with_function(names: &[Vec<u32>], blocks: &[Vec<u32>]) -> Vec<u32> {
        let mut parts = names.to_vec();
        parts.extend([
            instruction(op::DECORATE, &[FLAG, op::DECORATION_SPEC_ID, 1]),
            instruction(op::DECORATE, &[COUNT, op::DECORATION_SPEC_ID, 2]),
            instruction(op::TYPE_VOID, &[1]),
            instruction(op::TYPE_BOOL, &[BOOL]),
            instruction(op::TYPE_INT, &[UINT, 32, 0]),
            instruction(op::SPEC_TRUE, &[BOOL, FLAG]),
            instruction(op::SPEC, &[UINT, COUNT, 3]),
            instruction(op::CONSTANT, &[UINT, THREE, 3]),
            instruction(op::SPEC_OP, &[BOOL, IS_THREE, op::I_EQUAL, COUNT, THREE]),
            instruction(op::FUNCTION, &[1, 8, 0, 9]),
        ]);
        parts.extend(blocks.iter().cloned());
        parts.push(instruction(op::FUNCTION_END, &[]));
        module(&parts)
    }

    /// A choice of what `condition` says, whose sides are blocks 11 and 12, and which the phi instruction 15 ends.
    fn choice(condition: u32) -> Vec<Vec<u32>> {
        vec![
            instruction(op::LABEL, &[10]),
            instruction(op::SELECTION_MERGE, &[13, 0]),
            instruction(op::BRANCH_CONDITIONAL, &[condition, 11, 12]),
            instruction(op::LABEL, &[11]),
            instruction(op::I_ADD, &[UINT, 20, THREE, THREE]),
            instruction(op::BRANCH, &[13]),
            instruction(op::LABEL, &[12]),
            instruction(op::I_MUL, &[UINT, 21, THREE, THREE]),
            instruction(op::BRANCH, &[13]),
            instruction(op::LABEL, &[13]),
            instruction(op::PHI, &[UINT, 15, 20, 11, 21, 12]),
            instruction(op::RETURN, &[]),
        ]
    }

    fn of(words: &[u32]) -> Vec<Vec<u32>> {
        let instructions = split(&words[HEADER..]).expect("well formed");
        instructions.into_iter().map(<[u32]>::to_vec).collect()
    }

    #[test]
    fn one_side_of_a_known_choice_is_left() {
        // Without contraction, which names of what is left keep.
        let names = [20, 21].map(|id| instruction(op::DECORATE, &[id, 42]));
        let source = with_function(&names, &choice(FLAG));
        for (value, block, gone, sum) in [(1, 11, 12, 20), (0, 12, 11, 21)] {
            let left = of(&specialize(&source, &[(1, value)]).expect("sound"));
            let truth = if value == 1 {
                op::CONSTANT_TRUE
            } else {
                op::CONSTANT_FALSE
            };
            assert!(left.contains(&instruction(truth, &[BOOL, FLAG])));
            assert!(
                left.contains(&instruction(op::BRANCH, &[block])) && !left.contains(&instruction(op::LABEL, &[gone]))
            );
            assert!(left.contains(&instruction(op::PHI, &[UINT, 15, sum, block])));
            assert!(left.contains(&instruction(op::DECORATE, &[sum, 42])));
            assert!(!left.contains(&instruction(op::DECORATE, &[41 - sum, 42])));
            assert!(left.iter().all(|words| opcode(words) != op::SELECTION_MERGE && !words.ends_with(&[op::DECORATION_SPEC_ID, 1])));
        }
    }

    #[test]
    fn values_and_expressions_are_written_in() {
        let source = with_function(&[], &choice(IS_THREE));
        for (values, count, truth) in [(&[][..], 3, op::CONSTANT_TRUE), (&[(2, 4)][..], 4, op::CONSTANT_FALSE)] {
            let left = of(&specialize(&source, values).expect("sound"));
            assert!(left.contains(&instruction(op::CONSTANT, &[UINT, COUNT, count])));
            assert!(left.contains(&instruction(truth, &[BOOL, IS_THREE])));
            let sides = [11, 12].map(|label| left.contains(&instruction(op::LABEL, &[label])));
            assert_eq!(sides, [truth == op::CONSTANT_TRUE, truth == op::CONSTANT_FALSE]);
        }
    }

    #[test]
    fn a_selection_that_others_leave_stays() {
        // The side that is left goes to the end of the choice by what only the run knows.
        let mut blocks = choice(FLAG);
        blocks[4] = instruction(op::I_EQUAL, &[BOOL, 20, 30, THREE]);
        blocks[5] = instruction(op::BRANCH_CONDITIONAL, &[20, 13, 16]);
        blocks.splice(6..6, [instruction(op::LABEL, &[16]), instruction(op::BRANCH, &[13])]);
        let left = of(&specialize(&with_function(&[], &blocks), &[(1, 1)]).expect("sound"));
        assert!(left.contains(&instruction(op::SELECTION_MERGE, &[13, 0])));
        assert!(left.contains(&instruction(op::LABEL, &[12])));
    }

    #[test]
    fn loops_keep_their_way_back() {
        let blocks = [
            instruction(op::LABEL, &[10]),
            instruction(op::BRANCH, &[11]),
            instruction(op::LABEL, &[11]),
            instruction(op::PHI, &[UINT, 15, THREE, 10, 20, 12]),
            instruction(op::LOOP_MERGE, &[13, 12, 0]),
            instruction(op::BRANCH, &[12]),
            instruction(op::LABEL, &[12]),
            instruction(op::I_ADD, &[UINT, 20, 15, THREE]),
            instruction(op::BRANCH_CONDITIONAL, &[FLAG, 11, 13]),
            instruction(op::LABEL, &[13]),
            instruction(op::RETURN, &[]),
        ];
        for value in [0, 1] {
            let left = of(&specialize(&with_function(&[], &blocks), &[(1, value)]).expect("sound"));
            assert!(blocks.iter().all(|words| left.contains(words)));
        }
    }

    #[test]
    fn what_is_no_module_stays_as_it_is() {
        assert!(specialize(&[], &[]).is_none() && specialize(&[MAGIC], &[]).is_none());
        assert!(specialize(&module(&[vec![first_word(op::LABEL, 3), 1]]), &[]).is_none());
        assert!(specialize(&module(&[vec![0]]), &[]).is_none());
    }

    #[test]
    fn all_kernels_can_be_specialized_and_shrink() {
        let (mut before, mut without) = (0, 0);
        for shader in shaders::ALL {
            let words: Vec<u32> = shader
                .spirv
                .chunks_exact(4)
                .map(|bytes| u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]))
                .collect();
            for value in [0, 1] {
                let switches: Vec<(u32, u32)> = shader
                    .spec_constants
                    .iter()
                    .filter(|constant| constant.default <= 1)
                    .map(|constant| (constant.id, value))
                    .collect();
                let left = specialize(&words, &switches).unwrap_or_else(|| panic!("{}", shader.name));
                assert!(left.len() <= words.len(), "{}", shader.name);
                if value == 0 {
                    before += words.len();
                    without += left.len();
                }
            }
        }
        assert!(without < before / 2, "{without} of {before} words");
    }
}
