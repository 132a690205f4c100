//! Contact of deformable bodies.

use serde::{Deserialize, Serialize};

/// How bodies touch each other and themselves: their surfaces and the flanks of their cuts. `contacts.csv` has their
/// forces, states in VTK the pressure at nodes. Near a pressure of the softer body's Young's modulus contact gives way,
/// with a warning: bodies that close at 0.65 of the speed of sound bounce, at 0.86 they may pass through each other.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct BodyContact {
    /// Coulomb's coefficient of friction, of pairs that name none of their own.
    #[serde(default)]
    pub friction: f64,
    /// Which bodies touch.
    #[serde(default)]
    pub between: Between,
}

/// Which bodies touch.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub enum Between {
    /// All, each with itself too.
    #[default]
    All,
    /// These pairs.
    Pairs(Vec<Touching>),
}

/// Two bodies that touch.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Touching {
    /// Their names; a name twice for the flanks of one body.
    pub bodies: (String, String),
    /// Coulomb's coefficient of friction of this pair; `None` for that of all.
    #[serde(default)]
    pub friction: Option<f64>,
}

impl BodyContact {
    /// Coulomb's coefficient of friction of two bodies by their names; `None` if they do not touch.
    #[must_use]
    pub fn friction_of(&self, a: &str, b: &str) -> Option<f64> {
        let Between::Pairs(pairs) = &self.between else {
            return Some(self.friction);
        };
        let pair = pairs.iter().find(|pair| pair.is_of(a, b));
        pair.map(|pair| pair.friction.unwrap_or(self.friction))
    }
}

impl Touching {
    pub(crate) fn is_of(&self, a: &str, b: &str) -> bool {
        let (first, second) = &self.bodies;
        [(a, b), (b, a)].contains(&(first, second))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pair_has_its_own_friction_or_that_of_all() {
        let pair = |a: &str, b: &str, friction| Touching {
            bodies: (a.into(), b.into()),
            friction,
        };
        let pairs = vec![
            pair("a", "b", None),
            pair("b", "c", Some(0.0)),
            pair("a", "a", Some(0.7)),
        ];
        let contact = BodyContact {
            friction: 0.5,
            between: Between::Pairs(pairs),
        };
        let named = [
            "a b 0.5", "b a 0.5", "c b 0", "a a 0.7", "a c none", "b b none",
        ];
        for named in named {
            let [a, b, friction] = named.split(' ').collect::<Vec<_>>()[..] else {
                panic!("three words in {named}");
            };
            assert_eq!(contact.friction_of(a, b), friction.parse().ok(), "{named}");
        }
    }
}
