//! The forms of a metal's Fresnel factor that a scene can name.

/// How a metal's reflectance at an angle follows from its complex index of refraction. `transport::fresnel::form` evaluates it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FresnelForm {
    /// Fresnel's equations.
    #[default]
    Exact,
    /// Schlick's curve of the real part of the index; for comparison: the colours of metals are wrong.
    Schlick,
    /// Schlick's curve from the exact reflectance at normal incidence.
    Rescaled,
    /// That less a term with two coefficients a band.
    Compensated,
    /// That less a term with one coefficient a band, a tint of at most 1 at 82 degrees.
    F82Tint,
    /// That less a term with one coefficient a band, exact at 82 degrees.
    Hoffman,
    /// Fresnel's equations without the sine in their root.
    Simplified,
    /// Fresnel's equations from a table of 4 KiB, which holds them times the simplified geometric term.
    Table,
}

impl FresnelForm {
    /// All of them.
    pub const ALL: [Self; 8] = [
        Self::Exact,
        Self::Schlick,
        Self::Rescaled,
        Self::Compensated,
        Self::F82Tint,
        Self::Hoffman,
        Self::Simplified,
        Self::Table,
    ];

    /// Its name, as sidecars write it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Exact => "exact",
            Self::Schlick => "schlick",
            Self::Rescaled => "rescaled",
            Self::Compensated => "compensated",
            Self::F82Tint => "f82-tint",
            Self::Hoffman => "hoffman",
            Self::Simplified => "simplified",
            Self::Table => "table",
        }
    }
}

impl std::fmt::Display for FresnelForm {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}
