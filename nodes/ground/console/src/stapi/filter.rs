//! Filters in CQL2-JSON over numbers: comparisons, `between`, `and`, `or`, `not`.

use serde_json::Value;

/// How deep a filter may be.
const DEPTH: usize = 20;

/// Whether a filter lets something through whose properties `value` knows; absent ones let nothing through.
///
/// # Errors
/// With what is not understood, and where.
pub fn matches(filter: &Value, value: &impl Fn(&str) -> Option<Option<f64>>) -> Result<bool, String> {
    holds(filter, value, DEPTH)
}

fn holds(filter: &Value, value: &impl Fn(&str) -> Option<Option<f64>>, depth: usize) -> Result<bool, String> {
    let depth = depth.checked_sub(1).ok_or_else(|| format!("the filter is deeper than {DEPTH}"))?;
    let op = filter["op"].as_str().ok_or_else(|| format!("{filter} has no `op`"))?;
    let args = filter["args"].as_array().ok_or_else(|| format!("`{op}` has no `args`"))?;
    let number = |arg: &Value| -> Result<Option<f64>, String> {
        match (arg["property"].as_str(), arg.as_f64()) {
            (Some(name), _) => value(name).ok_or_else(|| format!("there is no queryable `{name}`")),
            (None, Some(number)) => Ok(Some(number)),
            (None, None) => Err(format!("{arg} is neither a property nor a number")),
        }
    };
    // Every part is looked at, so that what is wrong in one is told whatever the others say.
    let parts = || args.iter().map(|arg| holds(arg, value, depth)).collect::<Result<Vec<_>, _>>();
    let numbers = || args.iter().map(number).collect::<Result<Vec<_>, _>>();
    match (op, args.len()) {
        ("and", 1..) => Ok(parts()?.into_iter().all(|it| it)),
        ("or", 1..) => Ok(parts()?.into_iter().any(|it| it)),
        ("not", 1) => Ok(!parts()?.into_iter().all(|it| it)),
        ("between", 3) => Ok(matches!(numbers()?[..], [Some(it), Some(low), Some(high)] if low <= it && it <= high)),
        ("=" | "<>" | "<" | "<=" | ">" | ">=", 2) => {
            let numbers = numbers()?;
            let [Some(left), Some(right)] = numbers[..] else { return Ok(false) };
            Ok(match op {
                "=" => left == right,
                "<>" => left != right,
                "<" => left < right,
                "<=" => left <= right,
                ">" => left > right,
                _ => left >= right,
            })
        }
        _ => Err(format!("`{op}` of {} is not understood", args.len())),
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn elevation(filter: &Value, elevation: Option<f64>) -> Result<bool, String> {
        matches(filter, &|name| (name == "min_elevation_deg").then_some(elevation))
    }

    #[test]
    fn comparisons_and_what_joins_them() {
        let at_least = json!({"op": ">=", "args": [{"property": "min_elevation_deg"}, 30]});
        assert_eq!(elevation(&at_least, Some(30.0)), Ok(true));
        assert_eq!(elevation(&at_least, Some(29.9)), Ok(false));
        assert_eq!(elevation(&at_least, None), Ok(false));
        let between = json!({"op": "between", "args": [{"property": "min_elevation_deg"}, 30, 40]});
        assert_eq!(elevation(&between, Some(40.0)), Ok(true));
        let not = json!({"op": "not", "args": [between]});
        assert_eq!(elevation(&not, Some(40.0)), Ok(false));
        let either = json!({"op": "or", "args": [not, {"op": "and", "args": [at_least]}]});
        assert_eq!(elevation(&either, Some(35.0)), Ok(true));
    }

    #[test]
    fn what_is_not_understood_is_told() {
        for (filter, why) in [
            (json!({"op": "=", "args": [{"property": "cloud"}, 1]}), "no queryable `cloud`"),
            (json!({"op": "or", "args": [{"op": "=", "args": [1, 1]}, {"op": "like", "args": [1, 2]}]}), "`like` of 2"),
            (json!({"op": "=", "args": ["a", 1]}), "neither a property nor a number"),
            (json!({"args": []}), "no `op`"),
            (json!("x"), "no `op`"),
            (json!({"op": "and"}), "no `args`"),
        ] {
            let error = elevation(&filter, Some(1.0)).unwrap_err();
            assert!(error.contains(why), "{error}");
        }
        let deep = (0..100).fold(json!({"op": "=", "args": [1, 1]}), |it, _| json!({"op": "not", "args": [it]}));
        assert!(elevation(&deep, None).unwrap_err().contains("deeper"));
    }
}
