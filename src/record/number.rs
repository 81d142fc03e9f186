//! Floats that JSON cannot hold: NaN is `null`, infinities are `"inf"` and `"-inf"`.

use serde::{Deserialize, Deserializer, Serialize, Serializer};

#[derive(Serialize, Deserialize)]
#[serde(untagged)]
enum Number {
    Finite(f64),
    Infinite(Sign),
    Undefined,
}

#[derive(Serialize, Deserialize)]
enum Sign {
    #[serde(rename = "inf")]
    Plus,
    #[serde(rename = "-inf")]
    Minus,
}

impl From<f64> for Number {
    fn from(x: f64) -> Self {
        match x {
            f64::INFINITY => Self::Infinite(Sign::Plus),
            f64::NEG_INFINITY => Self::Infinite(Sign::Minus),
            x if x.is_nan() => Self::Undefined,
            x => Self::Finite(x),
        }
    }
}

impl From<Number> for f64 {
    fn from(n: Number) -> Self {
        match n {
            Number::Finite(x) => x,
            Number::Infinite(Sign::Plus) => Self::INFINITY,
            Number::Infinite(Sign::Minus) => Self::NEG_INFINITY,
            Number::Undefined => Self::NAN,
        }
    }
}

pub(super) fn serialize<S: Serializer>(x: &f64, s: S) -> Result<S::Ok, S::Error> {
    Number::from(*x).serialize(s)
}

pub(super) fn deserialize<'de, D: Deserializer<'de>>(d: D) -> Result<f64, D::Error> {
    Number::deserialize(d).map(f64::from)
}

/// The same for lists.
pub(super) mod list {
    use super::{Deserialize, Deserializer, Number, Serializer};

    pub(in super::super) fn serialize<S: Serializer>(values: &[f64], s: S) -> Result<S::Ok, S::Error> {
        s.collect_seq(values.iter().map(|&x| Number::from(x)))
    }

    pub(in super::super) fn deserialize<'de, D: Deserializer<'de>>(d: D) -> Result<Vec<f64>, D::Error> {
        Ok(Vec::<Number>::deserialize(d)?.into_iter().map(f64::from).collect())
    }
}
