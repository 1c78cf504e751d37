//! The difference of two documents, and of two pieces of bytes, in the few words that a page of one file has room for.

use serde_json::{Map, Value};

/// The patch that makes `new` of `old`; `None` where they are the same. It is that of RFC 7396 (a key with `null` is removed),
/// and an array of the same length is patched by the places of its elements.
pub fn patch(old: &Value, new: &Value) -> Option<Value> {
    if old == new {
        return None;
    }
    let mut changes = Map::new();
    match (old, new) {
        (Value::Object(old), Value::Object(new)) => {
            for (key, value) in new {
                let change = old
                    .get(key)
                    .map_or_else(|| Some(value.clone()), |old| patch(old, value));
                changes.extend(change.map(|change| (key.clone(), change)));
            }
            let removed = old.keys().filter(|key| !new.contains_key(*key));
            changes.extend(removed.map(|key| (key.clone(), Value::Null)));
        }
        (Value::Array(old), Value::Array(new)) if old.len() == new.len() && !new.is_empty() => {
            // `null` would remove an element.
            if new.contains(&Value::Null) {
                return Some(Value::Array(new.clone()));
            }
            let places = old.iter().zip(new).enumerate();
            changes
                .extend(places.filter_map(|(place, (old, new))| Some((place.to_string(), patch(old, new)?))));
            let whole = Value::Array(new.clone());
            let is_short = whole.to_string().len() <= Value::Object(changes.clone()).to_string().len();
            if is_short {
                return Some(whole);
            }
        }
        _ => return Some(new.clone()),
    }
    Some(Value::Object(changes))
}

/// How many bytes two pieces have in common at their begin, and at their end after it.
pub fn common(old: &[u8], new: &[u8]) -> (usize, usize) {
    let same = |(old, new): &(&u8, &u8)| old == new;
    let begin = old.iter().zip(new).take_while(same).count();
    let rest = old.len().min(new.len()) - begin;
    let end = old
        .iter()
        .rev()
        .zip(new.iter().rev())
        .take(rest)
        .take_while(same)
        .count();
    (begin, end)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    /// As the page applies it.
    fn applied(old: &Value, patch: &Value) -> Value {
        match (old, patch) {
            (Value::Object(old), Value::Object(patch)) => {
                let mut new = old.clone();
                for (key, change) in patch {
                    match change {
                        Value::Null => drop(new.remove(key)),
                        change => {
                            let value = old
                                .get(key)
                                .map_or_else(|| change.clone(), |old| applied(old, change));
                            new.insert(key.clone(), value);
                        }
                    }
                }
                Value::Object(new)
            }
            (Value::Array(old), Value::Object(patch)) => {
                let mut new = old.clone();
                for (place, change) in patch {
                    let place: usize = place.parse().unwrap();
                    new[place] = applied(&old[place], change);
                }
                Value::Array(new)
            }
            _ => patch.clone(),
        }
    }

    #[test]
    fn a_patch_makes_the_new_document() {
        let documents = [
            json!({"a": 1, "b": [1, 2, {"c": [true, "a long text"]}], "d": {"e": 1}}),
            json!({"a": 2, "b": [1, 2, {"c": [false, "a long text"]}], "d": {}}),
            json!({"b": [1, 2], "d": {"e": {"f": []}}}),
            json!({"b": [], "f": "x"}),
        ];
        for old in &documents {
            for new in &documents {
                match patch(old, new) {
                    None => assert_eq!(old, new),
                    Some(patch) => assert_eq!(&applied(old, &patch), new, "{patch}"),
                }
            }
        }
    }

    #[test]
    fn common_bytes_do_not_overlap() {
        assert_eq!(common(b"abcab", b"abXab"), (2, 2));
        assert_eq!(common(b"aaaa", b"aaaaaa"), (4, 0));
        assert_eq!(common(b"", b"x"), (0, 0));
        assert_eq!(common(b"same", b"same"), (4, 0));
    }
}
