//! Reads arm models from TOML: the ones shipped with the emulator, by name, and a user's own, by path. Whether the
//! numbers describe an arm is checked by the controller's `ArmModel::check`.
//!
//! Each table has a `source` that says where its numbers come from. A file without one is refused, because a model
//! with unfounded numbers would look like measured ones.

use super::error::{ConfigError, read_text};
use serde::Deserialize;
use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use ts3100_controller::model::{AXES, ArmKind, ArmModel, Axis, Joints, ScaraGeometry, SixAxisGeometry};
use ts3100_proto::words::{UnexpectedWord, plain_message};

/// The models shipped: name and file.
pub const SHIPPED: [(&str, &str); 5] = [
    (
        "ts3100-tv800",
        include_str!("../../../../fixtures/models/ts3100-tv800.toml"),
    ),
    (
        "tsl3000-thl400",
        include_str!("../../../../fixtures/models/tsl3000-thl400.toml"),
    ),
    (
        "tsl3000-thl400-4",
        include_str!("../../../../fixtures/models/tsl3000-thl400-4.toml"),
    ),
    (
        "tsl3000-thl300",
        include_str!("../../../../fixtures/models/tsl3000-thl300.toml"),
    ),
    (
        "scara-600",
        include_str!("../../../../fixtures/models/scara-600.toml"),
    ),
];
/// Fewest characters of a `source`.
const MIN_SOURCE: usize = 3;

/// The value of `--model`: a shipped model or a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ModelChoice {
    /// The name of a shipped model.
    Shipped(&'static str),
    /// The path of a TOML file.
    File(PathBuf),
}

impl fmt::Display for ModelChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            ModelChoice::Shipped(name) => f.write_str(name),
            ModelChoice::File(path) => path.display().fmt(f),
        }
    }
}

impl FromStr for ModelChoice {
    type Err = UnexpectedWord;

    /// The name of a shipped model (case is ignored), or a path that ends in `.toml`.
    fn from_str(text: &str) -> Result<ModelChoice, UnexpectedWord> {
        if let Some((name, _)) = SHIPPED.iter().find(|(name, _)| name.eq_ignore_ascii_case(text)) {
            return Ok(ModelChoice::Shipped(name));
        }
        let path = PathBuf::from(text);
        if path
            .extension()
            .is_some_and(|ending| ending.eq_ignore_ascii_case("toml"))
        {
            return Ok(ModelChoice::File(path));
        }
        let names: Vec<&str> = SHIPPED.iter().map(|(name, _)| *name).collect();
        let expected = format!("{} or the path of a .toml file", names.join(", "));
        Err(UnexpectedWord::new(expected, text).suggesting(names))
    }
}

impl ModelChoice {
    /// The path of the file, if it is one.
    pub fn path_mut(&mut self) -> Option<&mut PathBuf> {
        match self {
            ModelChoice::Shipped(_) => None,
            ModelChoice::File(path) => Some(path),
        }
    }

    /// Reads the model.
    ///
    /// # Errors
    /// The file cannot be read, is not TOML, or does not describe an arm.
    pub fn read(&self) -> Result<ArmModel, ConfigError> {
        let (path, text) = match self {
            ModelChoice::Shipped(shipped) => {
                let found = SHIPPED.iter().find(|(name, _)| name == shipped);
                let text = found.map_or("", |(_, text)| text).to_owned();
                (&PathBuf::from(format!("{shipped}.toml")), text)
            }
            ModelChoice::File(path) => (path, read_text(path)?),
        };
        parse(path, &text)
    }
}

/// Parses the text of a model file.
fn parse(path: &Path, text: &str) -> Result<ArmModel, ConfigError> {
    let invalid = |reason: &dyn fmt::Display| ConfigError::invalid(path.display(), reason);
    let file: ModelFile = toml::from_str(text).map_err(|error| ConfigError::toml(path, text, &error))?;
    let model = file.into_model().map_err(|error| invalid(&error))?;
    model.validate().map_err(|error| invalid(&error))?;
    Ok(model)
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ModelFile {
    name: String,
    kind: ModelKind,
    geometry: toml::Table,
    tool: ToolTable,
    axis: Vec<AxisTable>,
    ready: ReadyTable,
}

#[derive(Deserialize)]
#[serde(rename_all = "kebab-case")]
enum ModelKind {
    SixAxis,
    Scara,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SixAxisTable {
    source: String,
    shoulder_height: f64,
    shoulder_offset: f64,
    upper_arm: f64,
    elbow_offset: f64,
    forearm: f64,
    flange: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ScaraTable {
    source: String,
    first_arm: f64,
    second_arm: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ToolTable {
    source: String,
    max_speed: f64,
    max_accel: f64,
    max_turn_speed: f64,
    max_payload: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct AxisTable {
    source: String,
    min: f64,
    max: f64,
    max_speed: f64,
    max_accel: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ReadyTable {
    source: String,
    joints: Vec<f64>,
}

/// Error in a model file besides its form.
#[derive(Debug, thiserror::Error)]
enum ModelFileError {
    #[error("{table}: source: expected the origin of the numbers, found `{found}`")]
    Source { table: String, found: String },
    #[error("ready: joints: expected one for each of the {axes} axes, found {joints}")]
    Joints { axes: usize, joints: usize },
    #[error("geometry: {}", plain_message(.0.message()))]
    Geometry(toml::de::Error),
}

fn check_source(table: &str, source: &str) -> Result<(), ModelFileError> {
    if source.trim().chars().count() >= MIN_SOURCE {
        return Ok(());
    }
    let (table, found) = (table.to_owned(), source.to_owned());
    Err(ModelFileError::Source { table, found })
}

impl ModelFile {
    fn into_model(self) -> Result<ArmModel, ModelFileError> {
        check_source("tool", &self.tool.source)?;
        check_source("ready", &self.ready.source)?;
        for (number, axis) in (1..).zip(&self.axis) {
            check_source(&format!("axis {number}"), &axis.source)?;
        }
        let kind = match self.kind {
            ModelKind::SixAxis => {
                let arm: SixAxisTable = geometry(self.geometry)?;
                check_source("geometry", &arm.source)?;
                ArmKind::SixAxis(SixAxisGeometry {
                    shoulder_height: arm.shoulder_height,
                    shoulder_offset: arm.shoulder_offset,
                    upper_arm: arm.upper_arm,
                    elbow_offset: arm.elbow_offset,
                    forearm: arm.forearm,
                    flange: arm.flange,
                })
            }
            ModelKind::Scara => {
                let arm: ScaraTable = geometry(self.geometry)?;
                check_source("geometry", &arm.source)?;
                ArmKind::Scara(ScaraGeometry {
                    first_arm: arm.first_arm,
                    second_arm: arm.second_arm,
                })
            }
        };
        let joints = self.ready.joints.len();
        if joints != self.axis.len() || joints > AXES {
            let axes = self.axis.len();
            return Err(ModelFileError::Joints { axes, joints });
        }
        let mut ready = Joints::default();
        for (joint, value) in ready.iter_mut().zip(&self.ready.joints) {
            *joint = *value;
        }
        let axes = self.axis.iter().map(|axis| Axis {
            min: axis.min,
            max: axis.max,
            max_speed: axis.max_speed,
            max_accel: axis.max_accel,
        });
        Ok(ArmModel {
            name: self.name,
            kind,
            axes: axes.collect(),
            max_tool_speed: self.tool.max_speed,
            max_tool_accel: self.tool.max_accel,
            max_turn_speed: self.tool.max_turn_speed,
            max_payload: self.tool.max_payload,
            ready,
        })
    }
}

/// Reads the table `geometry`, whose keys depend on the kind of arm.
fn geometry<T: serde::de::DeserializeOwned>(table: toml::Table) -> Result<T, ModelFileError> {
    table.try_into().map_err(ModelFileError::Geometry)
}

#[cfg(test)]
mod tests {
    use super::{ModelChoice, SHIPPED, parse};
    use std::path::Path;
    use ts3100_controller::model::ArmModel;

    #[test]
    fn the_files_shipped_are_the_models_built_in() {
        for (name, _) in SHIPPED {
            let read = name.parse::<ModelChoice>().unwrap().read().unwrap();
            assert_eq!(Some(read), ArmModel::by_name(name));
        }
    }

    #[track_caller]
    fn refused(from: &str, to: &str, expected: &str) {
        let text = SHIPPED[0].1;
        assert!(text.contains(from), "{from}");
        let found = parse(Path::new("own.toml"), &text.replacen(from, to, 1))
            .unwrap_err()
            .to_string();
        assert!(
            ["own.toml: ", "own.toml, line "]
                .iter()
                .any(|file| found.starts_with(file))
                && found.contains(expected),
            "{found}"
        );
    }

    #[test]
    fn what_is_no_model_is_refused_with_its_place() {
        refused(
            "forearm = 380.0",
            "forearm = 0.5",
            "geometry.forearm: expected 1 to 10000, found 0.5",
        );
        refused(
            "forearm = 380.0",
            "fore_arm = 380.0",
            "geometry: unknown field `fore_arm`",
        );
        refused(
            "flange = 80.0",
            "flange = \"long\"",
            "geometry: expected a number, found \"long\"",
        );
        refused(
            "min = -165.0",
            "min = 166.0",
            "axis 3: min: expected -3600 to 165, found 166",
        );
        refused(
            "max_speed = 600.0",
            "max_speed = nan",
            "axis 6: max_speed: expected 0.001 to 100000, found NaN",
        );
        refused(
            "40.0, 0.0]",
            "40.0]",
            "ready: joints: expected one for each of the 6 axes, found 5",
        );
        refused(
            "source = \"assumed (D11): as axis 2\"",
            "source = \" \"",
            "axis 3: source: expected the origin of the numbers",
        );
        refused(
            "source = \"assumed (D11): as axis 2\"\n",
            "",
            ", line 36: the field `source` is missing",
        );
        refused("\"six-axis\"", "\"delta\"", "unknown value `delta`");
        refused("\"six-axis\"", "\"scara\"", "geometry: unknown field");
        refused(
            "[[axis]]\nsource = \"assumed (D11): as axis 2\"\nmin = -165.0\nmax = 165.0\nmax_speed = 300.0\nmax_accel = 1200.0\n",
            "",
            "ready: joints: expected one for each of the 5 axes, found 6",
        );
        refused("name = ", "name ", ", line 3: ");
    }

    #[test]
    fn a_choice_is_a_name_or_a_file() {
        assert_eq!(
            "TSL3000-THL400".parse(),
            Ok(ModelChoice::Shipped("tsl3000-thl400"))
        );
        assert_eq!(
            "models/own.toml".parse(),
            Ok(ModelChoice::File("models/own.toml".into()))
        );
        assert_eq!(
            "tv1000".parse::<ModelChoice>().unwrap_err().to_string(),
            "expected ts3100-tv800, tsl3000-thl400, tsl3000-thl400-4, tsl3000-thl300, scara-600 or the path of a .toml file, found `tv1000`"
        );
        let missing = ModelChoice::File("/nowhere/own.toml".into())
            .read()
            .unwrap_err()
            .to_string();
        assert!(missing.starts_with("cannot read /nowhere/own.toml"), "{missing}");
    }
}
