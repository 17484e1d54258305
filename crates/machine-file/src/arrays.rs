//! Arrays in places in which a machine file has to have a table.
//!
//! The reader of a table also takes an array, as the table's values in the order of its keys:
//! `limits = [0, 1]`. The schema does not, and the order is written nowhere.

use toml::de::{DeTable, DeValue};

/// The only key that has an array.
const ARRAY: &str = "homing.order";

/// The first key with an array in place of a table, and the byte at which the array begins. The
/// caller has read the text as a machine file already.
pub(super) fn misplaced(text: &str) -> Option<(String, usize)> {
    in_table(DeTable::parse(text).ok()?.get_ref(), "")
}

fn in_table(table: &DeTable<'_>, above: &str) -> Option<(String, usize)> {
    table.iter().find_map(|(name, value)| {
        let key = format!("{above}{}", name.get_ref());
        match value.get_ref() {
            DeValue::Array(_) if key != ARRAY => Some((key, value.span().start)),
            DeValue::Table(table) => in_table(table, &format!("{key}.")),
            _ => None,
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Profile;
    use schemars::schema_for;

    #[test]
    fn the_schema_has_one_array() {
        let schema = schema_for!(Profile).as_value().to_string();
        assert_eq!(schema.matches("\"array\"").count(), 1);
        assert!(schema.contains("\"order\""));
    }

    #[test]
    fn an_array_is_found_in_any_table() {
        for (text, key) in [
            ("name = \"x\"\n[axes.x]\nlimits = [0, 1]\n", "axes.x.limits"),
            ("[[axes.x]]\nhome = \"low\"\n", "axes.x"),
            ("door = [true, false]\n", "door"),
        ] {
            assert_eq!(misplaced(text).unwrap().0, key);
        }
        assert_eq!(misplaced("[homing]\norder = [\"z\"]\n"), None);
    }
}
