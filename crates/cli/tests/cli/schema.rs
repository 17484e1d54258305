//! The objects that `--json` prints, and their schemas.

use crate::program::{leadscrew, stdout, Folder, SQUARE};
use serde_json::Value;

/// Checks that `value` has the fields and types of `schema`, and no other fields.
fn fits(value: &Value, schema: &Value, root: &Value) -> Result<(), String> {
    if let Some(name) = schema["$ref"].as_str() {
        let target = root.pointer(name.trim_start_matches('#')).unwrap();
        return fits(value, target, root);
    }
    if let Some(any) = schema["anyOf"].as_array() {
        let fitting = any.iter().any(|one| fits(value, one, root).is_ok());
        return fitting
            .then_some(())
            .ok_or(format!("{value} fits none of {schema}"));
    }
    let kinds = match &schema["type"] {
        Value::Array(kinds) => kinds.clone(),
        kind => vec![kind.clone()],
    };
    let kind = match value {
        Value::Null => "null",
        Value::Bool(_) => "boolean",
        Value::Number(number) if number.is_f64() => "number",
        Value::Number(_) => "integer",
        Value::String(_) => "string",
        Value::Array(_) => "array",
        Value::Object(_) => "object",
    };
    let is_kind = |known: &Value| known == kind || known == "number" && kind == "integer";
    if !kinds.iter().any(is_kind) {
        return Err(format!("{value} is no {kinds:?}"));
    }
    for part in value.as_array().into_iter().flatten() {
        fits(part, &schema["items"], root)?;
    }
    for (name, part) in value.as_object().into_iter().flatten() {
        let known = schema["properties"].get(name);
        let known = known.or(schema.get("additionalProperties"));
        let known = known.or(schema["patternProperties"]
            .as_object()
            .and_then(|p| p.values().next()));
        fits(
            part,
            known.ok_or(format!("{name} is not in the schema"))?,
            root,
        )?;
    }
    for name in schema["required"].as_array().into_iter().flatten() {
        if value.get(name.as_str().unwrap()).is_none() {
            return Err(format!("{name} is missing"));
        }
    }
    Ok(())
}

#[test]
fn what_json_writes_fits_its_schema() {
    let folder = Folder::new();
    let job = folder.file("job.nc", format!("T1\nM0\n{SQUARE}G64 (never\n"));
    for command in ["run", "check", "profile"] {
        let schema = stdout(&leadscrew(&["schema", command]));
        let schema: Value = serde_json::from_str(&schema).unwrap();
        let text = stdout(&leadscrew(&[command, "--json", &job]));
        let json: Value = serde_json::from_str(&text).unwrap();
        assert_eq!(fits(&json, &schema, &schema), Ok(()), "{command}");
        let mut other = json.clone();
        other["lines"] = "six".into();
        assert!(fits(&other, &schema, &schema).is_err(), "{command}");
        other = json.clone();
        other.as_object_mut().unwrap().remove("version");
        assert!(fits(&other, &schema, &schema).is_err(), "{command}");
        other = json;
        other["more"] = 1.into();
        assert!(fits(&other, &schema, &schema).is_err(), "{command}");
    }
}

#[test]
fn findings_that_are_not_listed_are_counted() {
    let folder = Folder::new();
    let job = folder.file("job.nc", "G77\n(never\n".repeat(10_001));
    for (command, listed) in [("check", [10_000, 10_000]), ("run", [100, 10_000])] {
        let option = if command == "run" {
            "--keep-going"
        } else {
            "--quiet"
        };
        let text = stdout(&leadscrew(&[command, option, "--json", &job]));
        let json: Value = serde_json::from_str(&text).unwrap();
        for (kind, listed) in ["error", "warning"].into_iter().zip(listed) {
            let list = json[format!("{kind}s")].as_array().unwrap();
            assert_eq!(list.len(), listed, "{command} {kind}");
            assert_eq!(json[format!("{kind}_count")], 10_001, "{command} {kind}");
        }
    }
}
