//! Functions with their control flow, and what constants leave of them.

use std::collections::{HashMap, HashSet};

use super::Why;
use super::values::{Globals, Known, evaluate};
use super::words::{Words, first_word, op, opcode};

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

    fn heads_loop(&self) -> bool {
        self.merge().is_some_and(|merge| opcode(merge) == op::LOOP_MERGE)
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

/// A function in parts. Branches lead to its blocks, and back to headers of loops alone.
struct Function<'a> {
    /// What stands before the first block.
    head: &'a [Words<'a>],
    blocks: Vec<Block<'a>>,
    /// Places of blocks by their labels.
    places: HashMap<u32, usize>,
    /// What stands after the last block.
    end: &'a [Words<'a>],
}

impl<'a> Function<'a> {
    fn of(function: &'a [Words<'a>], has_long_ints: bool) -> Result<Self, Why> {
        if has_long_ints && function.iter().any(|words| opcode(words) == op::SWITCH) {
            return Err("it has a switch, which may be over integers of 64 bits");
        }
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
        let places: HashMap<u32, usize> = blocks.iter().enumerate().map(|(i, block)| (block.label, i)).collect();
        for (place, block) in blocks.iter().enumerate() {
            for target in block.targets() {
                let to = *places.get(&target).ok_or("it branches to what is no block of it")?;
                if to <= place && !blocks[to].heads_loop() {
                    return Err("it branches back to what heads no loop");
                }
            }
        }
        Ok(Self {
            head,
            blocks,
            places,
            end: rest,
        })
    }

    /// Whether a branch from the block at this place goes back.
    fn goes_back(&self, from: usize, target: u32) -> bool {
        self.places[&target] <= from
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

impl Flow {
    /// Follows it from the first block. Branches of the blocks `kept` stay as they are.
    fn of(function: &Function<'_>, known: &Known, kept: &HashSet<u32>) -> Result<Self, Why> {
        let mut flow = Self::default();
        let mut known = known.clone();
        flow.reached.extend(function.blocks.first().map(|block| block.label));
        for (place, block) in function.blocks.iter().enumerate() {
            if !flow.reached.contains(&block.label) {
                continue;
            }
            for words in &block.words {
                if let Some(value) = flow.value_of(words, function, place, &known) {
                    known.insert(words[2], value);
                }
            }
            let (last, targets) = (block.last(), block.targets());
            let goes_back = |target: &u32| function.goes_back(place, *target);
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
                    return Err("it comes to a loop from behind alone");
                }
                flow.edges.insert((block.label, target));
            }
        }
        Ok(flow)
    }

    /// Value of the result of an instruction in the block at this place, where constants tell it.
    fn value_of(&self, words: Words<'_>, function: &Function<'_>, place: usize, known: &Known) -> Option<u32> {
        match opcode(words) {
            op::PHI => {
                let label = function.blocks[place].label;
                let mut values = words[3..].chunks(2).filter_map(|pair| {
                    let [value, from] = *pair else { return None };
                    // What comes later, on the way back of a loop, is not known yet.
                    let is_later = function.places.get(&from).is_none_or(|from| *from >= place);
                    (is_later || self.edges.contains(&(from, label))).then(|| known.get(&value).copied())
                });
                let first = values.next()??;
                values.all(|value| value == Some(first)).then_some(first)
            }
            operation @ (op::I_ADD..=op::BIT_NOT) if words.len() > 3 => evaluate(operation, &words[3..], known),
            _ => None,
        }
    }

    fn reaches(&self, block: &Block<'_>) -> bool {
        self.reached.contains(&block.label)
    }

    /// Whether a selection goes with the branch that was its condition.
    fn drops_merge(&self, block: &Block<'_>) -> bool {
        let is_selection = block.merge().is_some_and(|merge| opcode(merge) == op::SELECTION_MERGE);
        is_selection && self.jumps.contains_key(&block.label)
    }

    /// Headers of selections whose branch would become a jump, but that another branch leaves without being a header itself: it would stand in no construct then.
    fn bound_selections(&self, blocks: &[Block<'_>]) -> Vec<u32> {
        let mut merges: HashMap<u32, Vec<u32>> = HashMap::new();
        for block in blocks {
            if let (Some(merge), Some(_)) = (block.merge(), self.jumps.get(&block.label)) {
                merges.entry(merge[1]).or_default().push(block.label);
            }
        }
        let leaves = blocks.iter().filter(|block| {
            self.reaches(block)
                && opcode(block.last()) == op::BRANCH_CONDITIONAL
                && block.merge().is_none()
                && !self.jumps.contains_key(&block.label)
        });
        let bound = leaves
            .flat_map(|block| block.targets())
            .filter_map(|target| merges.get(&target));
        bound.flatten().copied().collect()
    }

    /// Merge blocks of the constructs that are left, which stay whether anything reaches them or not. Loops that are left must have a way back.
    fn merge_blocks(&self, function: &Function<'_>) -> Result<HashSet<u32>, Why> {
        // Whether a branch that is left leads to this header of a loop from its own block or from a later one.
        let goes_back = |header: u32| {
            let mut edges = self.edges.iter();
            edges.any(|(from, to)| *to == header && function.goes_back(function.places[from], header))
        };
        let mut merge_blocks = HashSet::new();
        for block in function.blocks.iter().filter(|block| self.reaches(block)) {
            let Some(merge) = block.merge().filter(|_| !self.drops_merge(block)) else {
                continue;
            };
            merge_blocks.insert(merge[1]);
            // A loop names the block, too, where it goes on.
            if block.heads_loop() && !(self.reached.contains(&merge[2]) && goes_back(block.label)) {
                return Err("a loop of it would have no way back");
            }
        }
        Ok(merge_blocks)
    }
}

/// What is left of a function.
pub(super) struct Left {
    pub words: Vec<u32>,
    /// Ids that are gone.
    pub gone: Vec<u32>,
}

impl Left {
    /// Of a function's instructions, with the values of constants. An error says why it has to stay whole.
    pub fn of(function: &[Words<'_>], globals: &Globals) -> Result<Self, Why> {
        let function = Function::of(function, globals.has_long_ints)?;
        // Branches that have to stay, since what they head would lose its structure.
        let mut kept = HashSet::new();
        let flow = loop {
            let flow = Flow::of(&function, &globals.known, &kept)?;
            let bound = flow.bound_selections(&function.blocks);
            if bound.is_empty() {
                break flow;
            }
            kept.extend(bound);
        };
        let merge_blocks = flow.merge_blocks(&function)?;
        let mut left = Self {
            words: function.head.concat(),
            gone: Vec::new(),
        };
        for block in &function.blocks {
            if flow.reaches(block) {
                left.write(block, &flow)?;
                continue;
            }
            let stays = merge_blocks.contains(&block.label);
            if stays {
                let without_content = [first_word(op::LABEL, 2), block.label, first_word(op::UNREACHABLE, 1)];
                left.words.extend(without_content);
            }
            left.gone
                .extend(block.words.iter().filter_map(|words| match opcode(words) {
                    op::LABEL => (!stays).then_some(words[1]),
                    _ if words.len() > 2 && globals.types.contains(&words[1]) => Some(words[2]),
                    _ => None,
                }));
        }
        left.words.extend(function.end.concat());
        Ok(left)
    }

    fn write(&mut self, block: &Block<'_>, flow: &Flow) -> Result<(), Why> {
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
                        return Err("a phi instruction of it would have no values");
                    }
                    self.words
                        .extend([first_word(op::PHI, 3 + left.len()), words[1], words[2]]);
                    self.words.extend(left);
                }
                (op::SELECTION_MERGE, Some(_)) => {}
                (op::BRANCH_CONDITIONAL, Some(target)) if i == last => {
                    self.words.extend([first_word(op::BRANCH, 2), *target]);
                }
                _ => self.words.extend(*words),
            }
        }
        Ok(())
    }
}
