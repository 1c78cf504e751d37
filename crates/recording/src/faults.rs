//! Faults outside of the controller: reading them from the command line and from files, and listing the kinds. What a fault
//! does is decided by `ts3100-controller`; its outcome at the end is in `reports::faults`.

mod file;

pub use file::{FaultFileError, read};

use serde_json::{Value, json};
use ts3100_controller::faults::{Fault, FaultKind, KINDS, ParameterType};
use ts3100_controller::port::Port;
use ts3100_controller::variation::VARIATIONS;

/// A fault as JSON: what `POST /faults` takes and what reports have.
pub fn fault_json(fault: &Fault) -> Value {
    json!({
        "id": fault.id,
        "kind": fault.kind.name,
        "on": {
            "command": fault.filter.command,
            "channel": fault.filter.channel.map(Port::name),
            "block": fault.filter.block,
        },
        "after": fault.after,
        "times": fault.times,
        "probability": fault.chance(),
        "parameters": fault.parameters(),
    })
}

/// Every kind and every variation, for people.
pub fn kinds_text() -> String {
    let mut text = String::from(
        "Kinds of faults (--fault KIND:key=value,...; each also takes command, channel, block, after, times, probability):\n",
    );
    for kind in KINDS {
        text += &format!(
            "\n{}\n  {}\n  A robust host: {}\n",
            kind.name, kind.summary, kind.remedy
        );
        text += &format!("  Waits for: {}{}\n", points(kind).join("; "), defaults(kind));
        for parameter in kind.parameters {
            let default = parameter.default.map(|default| format!(" [default: {default}]"));
            text += &format!(
                "  {}={}  {}{}\n",
                parameter.name,
                placeholder(parameter.value_type),
                parameter.description,
                default.unwrap_or_default()
            );
        }
    }
    text += "\nLegal variation (--vary SEED):\n";
    for variation in VARIATIONS {
        text += &format!(
            "\n{}\n  {}\n  {}\n",
            variation.name, variation.summary, variation.source
        );
    }
    text
}

/// Trigger of faults of this kind.
pub fn points(kind: &FaultKind) -> Vec<&'static str> {
    kind.points.iter().map(|point| point.description()).collect()
}

fn defaults(kind: &FaultKind) -> String {
    let block = kind
        .block
        .map(|block| format!(" block={block}"))
        .unwrap_or_default();
    kind.command
        .map(|command| format!(" [default: command={command}{block}]"))
        .unwrap_or_default()
}

fn placeholder(takes: ParameterType) -> String {
    match takes {
        ParameterType::Number {
            unit,
            min: least,
            max: most,
        } => format!("{least}..{most} {unit}"),
        ParameterType::Word(words) => words.join("|"),
        ParameterType::Text { .. } => "TEXT".to_owned(),
        ParameterType::Alarm => "LEVEL-CODE".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ts3100_controller::variation::VariationRule;

    fn page(name: &str) -> String {
        let directory = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/");
        std::fs::read_to_string(format!("{directory}{name}")).unwrap()
    }

    #[test]
    fn every_kind_and_every_variation_is_listed_and_documented() {
        let (text, manual) = (kinds_text(), page("reference/faults.md"));
        for kind in KINDS {
            assert!(text.contains(&format!("\n{}\n", kind.name)), "{}", kind.name);
            assert!(manual.contains(&format!("### {}\n", kind.name)), "{}", kind.name);
            let example = format!("--fault '{}", kind.name);
            let examples = manual.lines().filter(|line| line.contains(&example));
            let specs = examples.filter_map(|line| line.split("--fault '").nth(1)?.split('\'').next());
            let specs: Vec<&str> = specs.collect();
            assert!(!specs.is_empty(), "{}: no example", kind.name);
            for spec in specs {
                let fault: Result<Fault, _> = spec.parse();
                assert_eq!(fault.map(|fault| fault.kind.name), Ok(kind.name), "{spec}");
            }
            for parameter in kind.parameters {
                let row = format!("`{}`", parameter.name);
                assert!(manual.contains(&row), "{} {}", kind.name, parameter.name);
            }
        }
        for variation in VARIATIONS {
            assert!(text.contains(variation.name));
            let VariationRule {
                name,
                summary: what,
                source,
            } = variation;
            let row = format!("| `{name}` | {what} | {source} |");
            assert!(page("explanation/variation.md").contains(&row), "{row}");
        }
    }

    #[test]
    fn a_fault_is_the_same_in_json() {
        let fault: Fault = "ng:command=DL,block=2,after=1,times=0,probability=0.5"
            .parse()
            .unwrap();
        assert_eq!(
            fault_json(&fault),
            json!({
                "id": 0, "kind": "ng",
                "on": { "command": "DL", "channel": null, "block": 2 },
                "after": 1, "times": 0, "probability": 0.5, "parameters": {},
            })
        );
        let late: Fault = "late-reply:channel=ip1,delay=2s".parse().unwrap();
        assert_eq!(fault_json(&late)["parameters"]["delay"], "2000");
        assert_eq!(fault_json(&late)["on"]["channel"], "IP1");
    }
}
