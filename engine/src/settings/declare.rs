//! What a declaration of settings gives: the trait that [`settings!`](crate::settings!) implements, and what cards keep of it.

use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value};

use super::range::Allowed;
use super::{Settings, shown, typed_number};
use crate::{Error, Result};

/// A setting, for help.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct SettingInfo {
    /// Its name in the JSON.
    pub name: &'static str,
    /// What it may be.
    pub range: String,
    /// The names that it may have, for an enum or a `bool`; else empty.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub names: Vec<&'static str>,
    /// Its unit; empty for what has none.
    pub unit: &'static str,
    /// Its default.
    pub default: Value,
    /// What it does, and whether it changes the expected picture: the first paragraph of its documentation.
    pub meaning: String,
}

/// Settings that were declared by [`settings!`](crate::settings!).
pub trait TypedSettings: std::fmt::Debug + Clone + Default + PartialEq + Send + Sync + 'static {
    /// What each setting means, in the order of the declaration.
    fn infos() -> Vec<SettingInfo>;

    /// All settings as a JSON object.
    fn to_json(&self) -> Value;

    /// Takes one setting from JSON; `false` where there is none of that name. Its range is looked at by [`check`](Self::check).
    ///
    /// # Errors
    /// [`Error::Setting`] for a value of another type.
    fn set(&mut self, name: &str, value: &Value) -> Result<bool>;

    /// Refuses what is out of range.
    ///
    /// # Errors
    /// [`Error::Setting`] with name, value and range.
    fn check(&self) -> Result<()>;

    /// Settings from a JSON object; what it leaves out takes its default, and `null` stands for all defaults.
    ///
    /// # Errors
    /// [`Error::Setting`] with the name of the setting that is unknown, of another type or out of range.
    fn from_json(json: &Value) -> Result<Self> {
        let mut settings = Self::default();
        let object = match json {
            Value::Null => return Ok(settings),
            Value::Object(object) => object,
            other => return Err(Error::setting("settings", shown(other), "is not a JSON object")),
        };
        for (name, value) in object {
            if !settings.set(name, value)? {
                let known: Vec<_> = Self::infos().iter().map(|info| info.name).collect();
                let cause = match known.is_empty() {
                    true => "is for no setting of that name; there is none".into(),
                    false => format!("is for no setting of that name; there is: {}", known.join(", ")),
                };
                return Err(Error::setting(name, shown(value), cause));
            }
        }
        settings.check()?;
        Ok(settings)
    }
}

/// What a card knows of its technique's settings.
#[derive(Debug, Clone, Copy)]
pub struct SettingsDecl {
    infos: fn() -> Vec<SettingInfo>,
    defaults: fn() -> Value,
    check: fn(&Settings) -> Result<()>,
    lifts: fn(&Settings, &str) -> bool,
}

impl SettingsDecl {
    /// No settings.
    pub const NONE: Self = Self::of::<()>();

    /// Those of a type.
    pub const fn of<T: TypedSettings>() -> Self {
        Self {
            infos: T::infos,
            defaults: || T::default().to_json(),
            check: |settings| settings.read::<T>().map(|_| ()),
            lifts: |_, _| false,
        }
    }

    /// The same where some settings take refusals back: `lifts` says whether settings do so with a reason of [`Card::refusals`](crate::techniques::Card::refusals).
    pub const fn lifting(self, lifts: fn(&Settings, &str) -> bool) -> Self {
        Self { lifts, ..self }
    }

    /// Whether settings take a refusal back.
    pub fn lifts(&self, settings: &Settings, reason: &str) -> bool {
        (self.lifts)(settings, reason)
    }

    /// What each setting means, in the order to explain them in.
    pub fn infos(&self) -> Vec<SettingInfo> {
        (self.infos)()
    }

    /// All defaults as a JSON object.
    pub fn defaults(&self) -> Value {
        (self.defaults)()
    }

    /// The settings' names, in the order to explain them in.
    pub fn names(&self) -> Vec<&'static str> {
        self.infos().iter().map(|info| info.name).collect()
    }

    /// Whether there is a setting of that name.
    pub fn has(&self, name: &str) -> bool {
        self.names().contains(&name)
    }

    /// Refuses settings as JSON that [`TypedSettings::from_json`] refuses.
    ///
    /// # Errors
    /// As [`TypedSettings::from_json`].
    pub fn check(&self, json: &Value) -> Result<()> {
        self.check_given(&json.clone().into())
    }

    /// Refuses settings that [`Settings::read`] refuses for the type of this declaration.
    ///
    /// # Errors
    /// As [`Settings::read`].
    pub fn check_given(&self, settings: &Settings) -> Result<()> {
        (self.check)(settings)
    }
}

/// The words on a setting; called by what [`settings!`](crate::settings!) makes.
#[doc(hidden)]
pub fn info<T: Serialize + 'static>(
    name: &'static str,
    default: &T,
    range: &impl Allowed<T>,
    unit: &'static str,
    documentation: &str,
) -> SettingInfo {
    let lines = documentation.lines().map(str::trim);
    let first: Vec<&str> = lines
        .skip_while(|line| line.is_empty())
        .take_while(|line| !line.is_empty())
        .collect();
    let meaning = first.join(" ");
    SettingInfo {
        name,
        range: range.text(),
        names: range.names(),
        unit,
        default: write(default),
        meaning: meaning.strip_suffix('.').unwrap_or(&meaning).to_owned(),
    }
}

/// A setting as JSON; called by what [`settings!`](crate::settings!) makes.
#[doc(hidden)]
pub fn write<T: Serialize + 'static>(value: &T) -> Value {
    match (value as &dyn std::any::Any).downcast_ref::<f32>() {
        Some(number) => typed_number(*number).into(),
        None => serde_json::to_value(value).unwrap_or_default(),
    }
}

/// A setting from JSON; called by what [`settings!`](crate::settings!) makes.
#[doc(hidden)]
pub fn read<T: DeserializeOwned>(name: &str, value: &Value, range: &impl Allowed<T>, unit: &str) -> Result<T> {
    serde_json::from_value(value.clone()).map_err(|error| {
        // Serde repeats a value in full.
        let error = error.to_string().replace(&value.to_string(), &shown(value));
        // Types of the engine's own name the setting by themselves.
        let cause = match error.strip_prefix(&format!("setting {name}: {} ", shown(value))) {
            Some(cause) => cause.to_owned(),
            None => format!("does not fit: {error}; it may be {}", with_unit(range.text(), unit)),
        };
        Error::setting(name, shown(value), cause)
    })
}

/// Refuses a value out of range; called by what [`settings!`](crate::settings!) makes.
#[doc(hidden)]
pub fn check<T>(name: &str, value: &T, range: &impl Allowed<T>, unit: &str) -> Result<()> {
    match range.refused(value) {
        Some(shown) => {
            let cause = format!("is out of range; it may be {}", with_unit(range.text(), unit));
            Err(Error::setting(name, shown, cause))
        }
        None => Ok(()),
    }
}

fn with_unit(range: String, unit: &str) -> String {
    if unit.is_empty() {
        range
    } else {
        format!("{range} ({unit})")
    }
}

/// Settings of a technique that has none.
impl TypedSettings for () {
    fn infos() -> Vec<SettingInfo> {
        Vec::new()
    }

    fn to_json(&self) -> Value {
        Value::Object(Map::new())
    }

    fn set(&mut self, _: &str, _: &Value) -> Result<bool> {
        Ok(false)
    }

    fn check(&self) -> Result<()> {
        Ok(())
    }
}
