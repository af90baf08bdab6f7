//! Reads path expressions; errors say the column and what would be right.

use super::automaton::{Dfa, TooLarge};
use super::expression::{CLASSES, Node, SIDES};
use super::{LOBE_VOLUME, PATH_SET_LOBES};

/// Greatest count in braces.
pub(super) const COUNT_MAX: u32 = 64;
/// Parentheses within parentheses.
const DEPTH_MAX: u32 = 32;

/// What is wrong with an expression, and at which character from 0.
#[derive(Debug)]
pub(super) struct Wrong {
    pub at: usize,
    pub cause: String,
}

type Read<T> = std::result::Result<T, Wrong>;

/// Reads a whole expression: `L…E` or, from the eye, `E…L`, several of them with `|`, all but them after `!`.
pub(super) fn read(text: &str) -> Read<Dfa> {
    let mut reader = Reader {
        characters: text.chars().collect(),
        at: 0,
        depth: 0,
    };
    let not = reader.take('!');
    let mut choices = vec![reader.path()?];
    while reader.take('|') {
        choices.push(reader.path()?);
    }
    if let Some(c) = reader.peek() {
        return Err(reader.wrong(format!(
            "{c:?} follows the end of a path; put '|' between paths and ',' between parts"
        )));
    }
    let too_large = |_: TooLarge| Wrong {
        at: 0,
        cause: "needs too large an automaton; use smaller counts, or bounces=A..B beside a shorter expression".into(),
    };
    let dfa = Dfa::of_expression(&Node::Alt(choices)).map_err(too_large)?;
    if not {
        let all = Dfa::repeated(PATH_SET_LOBES);
        return all.product(&dfa, |a, b| a && !b).map_err(too_large);
    }
    Ok(dfa)
}

struct Reader {
    characters: Vec<char>,
    at: usize,
    depth: u32,
}

impl Reader {
    fn wrong(&self, cause: impl Into<String>) -> Wrong {
        Wrong {
            at: self.at,
            cause: cause.into(),
        }
    }

    /// The next character that is not a blank.
    fn peek(&mut self) -> Option<char> {
        while self.characters.get(self.at).is_some_and(|c| c.is_whitespace()) {
            self.at += 1;
        }
        self.characters.get(self.at).copied()
    }

    fn take(&mut self, wanted: char) -> bool {
        let there = self.peek() == Some(wanted);
        self.at += usize::from(there);
        there
    }

    /// One path from end to end, in the order of the eye.
    fn path(&mut self) -> Read<Node> {
        let from_light = match self.peek() {
            Some('L') => true,
            Some('E') => false,
            Some('!') => return Err(self.wrong("'!' stands once, before everything; it means every path but these")),
            _ => {
                return Err(self
                    .wrong("a path begins with L, the light, and ends with E, the eye (or the other way round): LDE"));
            }
        };
        self.at += 1;
        let body = self.sequence()?;
        let end = if from_light { 'E' } else { 'L' };
        if self.peek() == Some('|') {
            let cause =
                format!("alternatives within a path stand in parentheses: L(D|S)E; a whole path ends with {end}");
            return Err(self.wrong(cause));
        }
        if !self.take(end) {
            return Err(self.unexpected(end));
        }
        Ok(if from_light { body.reversed() } else { body })
    }

    /// What is wrong where the end of a path should be.
    fn unexpected(&mut self, end: char) -> Wrong {
        let Some(c) = self.peek() else {
            return self.wrong(format!("the path has no end: it lacks {end}"));
        };
        let known = "D diffuse, G glossy, S specular, V volume, . any, [DG], [^S], (…)";
        let cause = match c {
            'L' | 'E' => format!("{c} stands at the ends of a path only; this one ends with {end}"),
            ')' => "')' has no '('".into(),
            ']' => "']' has no '['".into(),
            '*' | '+' | '?' | '{' => format!("{c:?} has nothing before it to repeat"),
            'r' | 't' => format!("{c:?} is a side, r reflected or t transmitted, and follows a class: G{c}"),
            'd' | 'g' | 's' | 'v' => format!("events are capital letters: {}", c.to_ascii_uppercase()),
            '!' => "'!' stands once, before everything; a set of other events is [^…]".into(),
            _ => format!("{c:?} is not an event: {known}"),
        };
        self.wrong(cause)
    }

    fn sequence(&mut self) -> Read<Node> {
        let mut parts = Vec::new();
        while let Some(atom) = self.atom()? {
            parts.push(self.repeated(atom)?);
        }
        Ok(Node::Cat(parts))
    }

    fn atom(&mut self) -> Read<Option<Node>> {
        let Some(c) = self.peek() else { return Ok(None) };
        if c == '(' {
            return self.group().map(Some);
        }
        let first = self.at;
        let set = match c {
            '.' => PATH_SET_LOBES,
            '[' => self.class_set()?,
            _ => match CLASSES.iter().find(|(letter, _)| *letter == c) {
                Some((_, class)) => *class,
                None => return Ok(None),
            },
        };
        self.at += 1;
        self.sided(set, first).map(|set| Some(Node::Set(set)))
    }

    /// A suffix that leaves one side of a set.
    fn sided(&mut self, set: u32, first: usize) -> Read<u32> {
        // A blank ends an event.
        let next = self.characters.get(self.at);
        let Some((_, side)) = SIDES.iter().find(|(suffix, _)| next == Some(suffix)) else {
            return Ok(set);
        };
        self.at += 1;
        if set & side == 0 {
            let cause = if set == LOBE_VOLUME {
                "media have no sides: write V"
            } else {
                "leaves no event of that side"
            };
            return Err(Wrong {
                at: first,
                cause: cause.into(),
            });
        }
        Ok(set & side)
    }

    /// `(…|…)`.
    fn group(&mut self) -> Read<Node> {
        let opened = self.at;
        self.at += 1;
        self.depth += 1;
        if self.depth > DEPTH_MAX {
            return Err(self.wrong(format!("parentheses are nested more than {DEPTH_MAX} deep")));
        }
        let mut choices = Vec::new();
        loop {
            let choice = self.sequence()?;
            if choice == Node::EMPTY && matches!(self.peek(), Some('|' | ')')) {
                return Err(
                    self.wrong("there is nothing to choose here; what may be missing is marked with '?': (D|S)?")
                );
            }
            choices.push(choice);
            if self.take(')') {
                break;
            }
            match self.peek() {
                Some('|') => self.at += 1,
                None | Some('E' | 'L') => {
                    return Err(Wrong {
                        at: opened,
                        cause: "'(' has no ')'".into(),
                    });
                }
                Some(_) => return Err(self.unexpected(')')),
            }
        }
        self.depth -= 1;
        Ok(Node::Alt(choices))
    }

    /// `[DGt]` or `[^S]`, up to the bracket that closes it.
    fn class_set(&mut self) -> Read<u32> {
        let opened = self.at;
        self.at += 1;
        let not = self.take('^');
        let mut set = 0;
        loop {
            match self.peek() {
                Some(']') => break,
                Some(c) => {
                    let Some((_, class)) = CLASSES.iter().find(|(letter, _)| *letter == c) else {
                        return Err(self.wrong(format!(
                            "{c:?} cannot stand in brackets: only D, G, S, V, each with r or t after it if need be"
                        )));
                    };
                    let first = self.at;
                    self.at += 1;
                    set |= self.sided(*class, first)?;
                }
                None => {
                    return Err(Wrong {
                        at: opened,
                        cause: "'[' has no ']'".into(),
                    });
                }
            }
        }
        let set = if not { PATH_SET_LOBES & !set } else { set };
        if set == 0 {
            return Err(Wrong {
                at: opened,
                cause: "no event is left in these brackets".into(),
            });
        }
        Ok(set)
    }

    /// An atom with the counts that follow it.
    fn repeated(&mut self, mut node: Node) -> Read<Node> {
        loop {
            let (min, max) = match self.peek() {
                Some('*') => (0, None),
                Some('+') => (1, None),
                Some('?') => (0, Some(1)),
                Some('{') => self.braces()?,
                _ => return Ok(node),
            };
            self.at += 1;
            node = Node::Repeat(Box::new(node), min, max);
        }
    }

    /// `{n}`, `{n,}`, `{n,m}`, up to the brace that closes it.
    fn braces(&mut self) -> Read<(u32, Option<u32>)> {
        let opened = self.at;
        self.at += 1;
        let min = self.number()?;
        let max = if !self.take(',') {
            Some(min)
        } else if self.peek() == Some('}') {
            None
        } else {
            Some(self.number()?)
        };
        if self.peek() != Some('}') {
            return Err(self.wrong("a count is {2}, {1,3} or {2,}"));
        }
        if max.is_some_and(|max| max < min) {
            return Err(Wrong {
                at: opened,
                cause: "the first count must not be greater than the second".into(),
            });
        }
        Ok((min, max))
    }

    fn number(&mut self) -> Read<u32> {
        self.peek();
        let first = self.at;
        while self.characters.get(self.at).is_some_and(char::is_ascii_digit) {
            self.at += 1;
        }
        let digits: String = self.characters[first..self.at].iter().collect();
        let wrong = |cause: String| Wrong { at: first, cause };
        if digits.is_empty() {
            return Err(wrong("a count is {2}, {1,3} or {2,}".into()));
        }
        let too_great = || {
            wrong(format!(
                "counts go up to {COUNT_MAX}; for longer paths write bounces=A..B beside the expression"
            ))
        };
        digits.parse().ok().filter(|n| *n <= COUNT_MAX).ok_or_else(too_great)
    }
}
