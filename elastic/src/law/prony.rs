//! Terms of Prony series.

/// One term of a Prony series: stress beyond that of the long term, `ratio · S`, which fades. `S` is the stress of the law without
/// what resists a change of volume alone: the bulk stays elastic (Holzapfel 2000, ch. 6.10), but for Saint Venant–Kirchhoff's law, which has no such part.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct PronyTerm {
    /// `beta`, shear stiffness of the term over that of the long term; 0 for no term.
    pub ratio: f64,
    /// `tau`: time (s) in which its stress falls to 1/e.
    #[cfg_attr(feature = "serde", serde(rename = "time"))]
    pub relaxation_time: f64,
}

impl PronyTerm {
    /// No term.
    pub const NONE: Self = Self {
        ratio: 0.0,
        relaxation_time: 1.0,
    };
}

/// Most terms of a material's Prony series.
pub const MAX_PRONY_TERMS: usize = 4;
