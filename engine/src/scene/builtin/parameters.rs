//! Parameters of generated scenes: their declaration, and the reading of `builtin:name?key=value&key=value` addresses.
//!
//! Guarantees: a key is declared once with its default and range; a value outside is refused with what is allowed.

use std::collections::BTreeMap;

use glam::Vec3;

use crate::{Error, Result};

/// What a parameter may hold.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
#[serde(rename_all = "snake_case", tag = "kind")]
pub enum ParameterKind {
    /// A real number in a closed range.
    Real {
        /// Least value.
        min: f64,
        /// Greatest value.
        max: f64,
    },
    /// A whole number in a closed range.
    Integer {
        /// Least value.
        min: u32,
        /// Greatest value.
        max: u32,
    },
    /// Three real numbers `r,g,b` in a closed range, or one for all three.
    Color {
        /// Least component.
        min: f64,
        /// Greatest component.
        max: f64,
    },
    /// One of some words.
    Choice {
        /// The words.
        words: &'static [&'static str],
    },
}

impl std::fmt::Display for ParameterKind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Real { min, max } => write!(f, "{min} … {max}"),
            Self::Integer { min, max } => write!(f, "whole, {min} … {max}"),
            Self::Color { min, max } => write!(f, "r,g,b or one number, {min} … {max}"),
            Self::Choice { words } => f.write_str(&words.join(" | ")),
        }
    }
}

/// A parameter of a generated scene.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Parameter {
    /// The key in the address.
    pub name: &'static str,
    /// The value without the key.
    pub default: &'static str,
    /// What it may hold.
    pub range: ParameterKind,
    /// What it means, with its unit.
    pub meaning: &'static str,
}

impl Parameter {
    const fn new(name: &'static str, default: &'static str, range: ParameterKind, meaning: &'static str) -> Self {
        Self {
            name,
            default,
            range,
            meaning,
        }
    }

    pub(super) const fn real(
        name: &'static str,
        default: &'static str,
        min: f64,
        max: f64,
        meaning: &'static str,
    ) -> Self {
        Self::new(name, default, ParameterKind::Real { min, max }, meaning)
    }

    pub(super) const fn integer(
        name: &'static str,
        default: &'static str,
        min: u32,
        max: u32,
        meaning: &'static str,
    ) -> Self {
        Self::new(name, default, ParameterKind::Integer { min, max }, meaning)
    }

    pub(super) const fn color(
        name: &'static str,
        default: &'static str,
        min: f64,
        max: f64,
        meaning: &'static str,
    ) -> Self {
        Self::new(name, default, ParameterKind::Color { min, max }, meaning)
    }

    pub(super) const fn choice(
        name: &'static str,
        default: &'static str,
        words: &'static [&'static str],
        meaning: &'static str,
    ) -> Self {
        Self::new(name, default, ParameterKind::Choice { words }, meaning)
    }
}

/// A value that was checked against its declaration.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Value {
    Real(f64),
    Integer(u32),
    Color(Vec3),
    Word(&'static str),
}

/// The values of all parameters of one scene.
#[derive(Debug)]
pub(super) struct Values {
    pub address: String,
    values: BTreeMap<&'static str, Value>,
}

impl Values {
    /// Reads the part after `?`; `address` is the whole, for errors.
    pub fn parse(address: &str, query: &str, declared: &[Parameter]) -> Result<Self> {
        let mut values = BTreeMap::new();
        for pair in query.split('&').filter(|pair| !pair.is_empty()) {
            let (key, text) = pair
                .split_once('=')
                .ok_or_else(|| Error::scene(address, format!("{pair:?}"), "has no value; write key=value"))?;
            let Some(parameter) = declared.iter().find(|p| p.name == key) else {
                let known: Vec<&str> = declared.iter().map(|p| p.name).collect();
                let cause = if known.is_empty() {
                    "unknown; this scene has no parameters".into()
                } else {
                    format!("unknown; allowed: {}", known.join(", "))
                };
                return Err(Error::scene(address, format!("key {key:?}"), cause));
            };
            if values.contains_key(parameter.name) {
                return Err(Error::scene(address, format!("key {key:?}"), "given twice"));
            }
            values.insert(parameter.name, read(address, parameter, text)?);
        }
        for parameter in declared {
            if !values.contains_key(parameter.name) {
                values.insert(parameter.name, read(address, parameter, parameter.default)?);
            }
        }
        Ok(Self {
            address: address.into(),
            values,
        })
    }

    fn missing(&self, name: &str, kind: &str) -> Error {
        Error::scene(
            &self.address,
            format!("key {name:?}"),
            format!("is not declared as {kind}"),
        )
    }

    pub fn real(&self, name: &str) -> Result<f64> {
        match self.values.get(name) {
            Some(Value::Real(x)) => Ok(*x),
            _ => Err(self.missing(name, "a real number")),
        }
    }

    pub fn integer(&self, name: &str) -> Result<u32> {
        match self.values.get(name) {
            Some(Value::Integer(x)) => Ok(*x),
            _ => Err(self.missing(name, "a whole number")),
        }
    }

    pub fn color(&self, name: &str) -> Result<Vec3> {
        match self.values.get(name) {
            Some(Value::Color(x)) => Ok(*x),
            _ => Err(self.missing(name, "a colour")),
        }
    }

    pub fn word(&self, name: &str) -> Result<&'static str> {
        match self.values.get(name) {
            Some(Value::Word(x)) => Ok(x),
            _ => Err(self.missing(name, "a word")),
        }
    }

    pub fn yes(&self, name: &str) -> Result<bool> {
        Ok(self.word(name)? == "yes")
    }
}

fn read(address: &str, parameter: &Parameter, text: &str) -> Result<Value> {
    let refuse = || {
        Error::scene(
            address,
            format!("key {:?}", parameter.name),
            format!("value {text:?} is not allowed; allowed: {}", parameter.range),
        )
    };
    let number = |text: &str, min: f64, max: f64| {
        let value = text.trim().parse::<f64>().ok()?;
        // Also false for NaN.
        (min <= value && value <= max).then_some(value)
    };
    let value = match parameter.range {
        ParameterKind::Real { min, max } => number(text, min, max).map(Value::Real),
        ParameterKind::Integer { min, max } => {
            let value = text.trim().parse::<u32>().ok();
            value.filter(|v| (min..=max).contains(v)).map(Value::Integer)
        }
        ParameterKind::Color { min, max } => {
            let parts: Option<Vec<f64>> = text.split(',').map(|part| number(part, min, max)).collect();
            match parts.as_deref() {
                Some([v]) => Some(Value::Color(Vec3::splat(*v as f32))),
                Some([r, g, b]) => Some(Value::Color(Vec3::new(*r as f32, *g as f32, *b as f32))),
                _ => None,
            }
        }
        ParameterKind::Choice { words } => words.iter().find(|w| **w == text).map(|w| Value::Word(w)),
    };
    value.ok_or_else(refuse)
}
