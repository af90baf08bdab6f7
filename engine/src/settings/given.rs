//! Settings as a host gives them: a struct, or JSON.

use std::any::Any;
use std::sync::Arc;

use serde_json::Value;

use super::TypedSettings;
use crate::{Error, Result};

/// Settings of a technique: its struct, or JSON for what comes from files. By default the technique's defaults.
///
/// ```
/// use clerestory::settings::Settings;
/// use clerestory::techniques::PathTracerSettings;
///
/// let typed = Settings::of(PathTracerSettings {
///     roulette_start: 8,
///     ..PathTracerSettings::default()
/// });
/// let read = Settings::from(serde_json::json!({ "roulette_start": 8 }));
/// assert_eq!(typed.read::<PathTracerSettings>()?, read.read()?);
/// # Ok::<(), clerestory::Error>(())
/// ```
#[derive(Debug, Clone, Default)]
pub struct Settings(Given);

#[derive(Debug, Clone, Default)]
enum Given {
    #[default]
    Defaults,
    Json(Value),
    Typed(Arc<dyn Stored>),
}

/// Settings of a type that is no longer known.
trait Stored: std::fmt::Debug + Send + Sync {
    fn json(&self) -> Value;
    fn any(&self) -> &dyn Any;
}

impl<T: TypedSettings> Stored for T {
    fn json(&self) -> Value {
        self.to_json()
    }

    fn any(&self) -> &dyn Any {
        self
    }
}

impl Settings {
    /// A technique's own struct.
    pub fn of<T: TypedSettings>(settings: T) -> Self {
        Self(Given::Typed(Arc::new(settings)))
    }

    /// As JSON, `null` for the defaults. What a struct has beside (seeds, say) is not in it.
    pub fn to_json(&self) -> Value {
        match &self.0 {
            Given::Defaults => Value::Null,
            Given::Json(json) => json.clone(),
            Given::Typed(settings) => settings.json(),
        }
    }

    /// As a technique's struct, checked.
    ///
    /// # Errors
    /// [`Error::Setting`] for the struct of another technique, and as [`TypedSettings::from_json`].
    pub fn read<T: TypedSettings>(&self) -> Result<T> {
        let settings = match &self.0 {
            Given::Defaults => T::default(),
            Given::Json(json) => T::from_json(json)?,
            Given::Typed(settings) => settings.any().downcast_ref::<T>().cloned().ok_or_else(|| {
                let cause = format!("are not the technique's: it takes {}", std::any::type_name::<T>());
                Error::setting("settings", settings.json(), cause)
            })?,
        };
        settings.check()?;
        Ok(settings)
    }
}

/// JSON, as it stands in files.
impl From<Value> for Settings {
    fn from(json: Value) -> Self {
        Self(Given::Json(json))
    }
}

impl<T: TypedSettings> From<T> for Settings {
    fn from(settings: T) -> Self {
        Self::of(settings)
    }
}
