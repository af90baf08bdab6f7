//! Modules with the values of their specialization constants written in, without the code that these leave out.
//!
//! Kernels hold what every scene may need behind constants. Drivers translate all of it before they drop what the constants exclude, on each start, since their caches
//! hold what comes after: a software driver takes 0.2 s for the shading kernel of a scene of plain surfaces. Here the same is dropped in a pass over the words.
//!
//! What is done: constants get their values, expressions of them too; branches on known conditions become jumps, with the selections that they headed; blocks that
//! nothing reaches are left out, with their places in phi instructions, names and decorations. A block that a structured construct names stays, without content.
//! Nothing is moved, and no operation that stays is changed; arithmetic of floating point is never evaluated. A function that this would not leave sound stays whole,
//! and has the values of the constants all the same. Modules must be valid.
//!
//! Source of the rules: SPIR-V specification 1.3, §2.11 (structured control flow) and §2.4 (logical layout).

mod functions;
#[cfg(test)]
mod tests;
mod values;
mod words;

use std::collections::HashSet;

use functions::Left;
use values::Globals;
use words::{HEADER, MAGIC, op, opcode, split};

/// Why something stays as it is, in words that follow its name.
type Why = &'static str;

/// The module with these values of constants by their ids in the interface, and defaults where none is given; `None` for a module that it cannot do this with, which
/// is sound as it is. What stays whole is told in the log, by `name` and the ids of functions.
pub(super) fn specialize(name: &str, module: &[u32], values: &[(u32, u32)]) -> Option<Vec<u32>> {
    let mut whole = Vec::new();
    let written = write(module, values, &mut whole);
    for (function, why) in whole {
        tracing::debug!(name, function, why, "a function is not specialized");
    }
    match written {
        Ok(written) => Some(written),
        Err(why) => {
            tracing::debug!(name, why, "a module is not specialized");
            None
        }
    }
}

/// Writes the module, and adds the functions that stay whole.
fn write(module: &[u32], values: &[(u32, u32)], whole: &mut Vec<(u32, Why)>) -> Result<Vec<u32>, Why> {
    if module.first() != Some(&MAGIC) {
        return Err("it does not begin as a module");
    }
    let instructions = module.get(HEADER..).and_then(split);
    let instructions = instructions.ok_or("it does not end where its last instruction does")?;
    let first_function = instructions
        .iter()
        .position(|words| opcode(words) == op::FUNCTION)
        .unwrap_or(instructions.len());
    let (global, code) = instructions.split_at(first_function);
    let globals = Globals::with_values(global, values)?;
    let mut body = Vec::with_capacity(module.len());
    let mut gone = HashSet::new();
    for function in code.split_inclusive(|words| opcode(words) == op::FUNCTION_END) {
        match Left::of(function, &globals) {
            Ok(left) => {
                body.extend(left.words);
                gone.extend(left.gone);
            }
            Err(why) => {
                let begin = function.iter().find(|words| opcode(words) == op::FUNCTION);
                whole.extend(begin.map(|words| (words[2], why)));
                body.extend(function.concat());
            }
        }
    }
    let mut out = module[..HEADER].to_vec();
    for words in globals.instructions {
        let is_of_removed = matches!(
            opcode(&words),
            op::NAME | op::DECORATE | op::DECORATE_ID | op::DECORATE_STRING
        ) && gone.contains(&words[1]);
        if !is_of_removed {
            out.extend(words);
        }
    }
    out.extend(body);
    Ok(out)
}
