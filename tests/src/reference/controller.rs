//! The tables of alarms, findings, options and variations.

use super::{code, table};
use std::fmt::Write as _;
use ts3100_controller::alarm::ALARMS;
use ts3100_controller::findings::RULES;
use ts3100_controller::model::{ArmKind, ArmModel};
use ts3100_controller::variation::VARIATIONS;
use ts3100_controller::{CONDITION_FORMS, Dialect};
use ts3100_emulator::config::OPTIONS;
use ts3100_proto::status::AlarmLevel;

/// Every alarm, the worst level first.
pub fn alarms() -> String {
    let mut alarms: Vec<_> = ALARMS.iter().collect();
    let worst = |level| AlarmLevel::ALL.iter().position(|other| *other == level);
    alarms.sort_by_key(|alarm| (worst(alarm.level), alarm.code));
    table(
        ["Alarm", "Evidence", "Text", "Cause", "Remedy"],
        alarms.into_iter().map(|alarm| {
            let number = alarm.number();
            [
                format!("[{number}](#alarm-{number})"),
                alarm.source.as_str().to_owned(),
                alarm.text.to_owned(),
                alarm.cause.to_owned(),
                alarm.remedy.to_owned(),
            ]
        }),
    )
}

/// Every built-in arm with its axes.
pub fn models() -> String {
    let rows = ArmModel::built_in().into_iter().flat_map(|model| {
        let name = model.name.clone();
        let slides = |index: usize| matches!(model.kind, ArmKind::Scara(_)) && index == 2;
        let rows: Vec<[String; 4]> = (0..)
            .zip(&model.axes)
            .map(|(index, axis)| {
                let unit = if slides(index) { "mm" } else { "degrees" };
                [
                    format!("`{name}`"),
                    format!("{}", index + 1),
                    format!("{} to {} {unit}", axis.min, axis.max),
                    format!("{} {unit}/s", axis.max_speed),
                ]
            })
            .collect();
        rows
    });
    table(["Model", "Axis", "Range", "Speed"], rows)
}

/// Every form of a condition.
pub fn conditions() -> String {
    table(
        ["Condition", "Example", "Met when", "State"],
        CONDITION_FORMS.iter().map(|row| {
            let state = if row.is_state { "yes" } else { "no" };
            [
                code(row.form),
                code(row.example),
                row.happens.to_owned(),
                state.to_owned(),
            ]
        }),
    )
}

/// Every rule of findings: a table, then a section each.
pub fn findings() -> String {
    let mut text = table(
        ["Rule", "Severity", "Violation"],
        RULES.iter().map(|rule| {
            [
                format!("[`{}`](#{})", rule.id, rule.id),
                rule.severity.as_str().to_owned(),
                rule.title.to_owned(),
            ]
        }),
    );
    for rule in RULES {
        // The clauses in brackets are for the fidelity page.
        let section = rule.source.split(" [").next().unwrap_or_default();
        let manual = match section.starts_with(|first: char| first.is_ascii_digit()) {
            true => format!("Manual, section {section}."),
            false => format!("Source: {section}."),
        };
        let (id, severity) = (rule.id, rule.severity.as_str());
        write!(text, "\n\n### {id}\n\n{}. *{severity}*\n\n", rule.title).unwrap();
        write!(text, "{} {manual}", rule.remedy).unwrap();
    }
    text
}

/// Every option with its values and the defaults of both dialects.
pub fn options() -> String {
    let default = |key: &str, value: &str| match (key, value) {
        ("input.malformed", "") => "`alarm` on a SCARA, `leading-number` on six axes".to_owned(),
        (_, "") => "0.001 on a SCARA, 0 on six axes".to_owned(),
        (_, value) => code(value),
    };
    table(
        [
            "Option",
            "What it decides",
            "Values",
            "Default in `field`",
            "Default in `manual`",
        ],
        OPTIONS.iter().map(|row| {
            [
                format!("[`{0}`](#{0})", row.key),
                row.about().to_owned(),
                row.values().to_string(),
                default(row.key, &row.default_in(Dialect::Field)),
                default(row.key, &row.default_in(Dialect::Manual)),
            ]
        }),
    )
}

/// Every variation and why the manual allows it.
pub fn variations() -> String {
    table(
        ["Variation", "What varies", "Why the manual allows it"],
        VARIATIONS
            .iter()
            .map(|rule| [code(rule.name), rule.summary.to_owned(), rule.source.to_owned()]),
    )
}
