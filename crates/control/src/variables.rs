//! `/variables` and `/positions`: GLOBAL and DATA variables of the selected file: read, set, teach.
//!
//! Values are checked and stored by the controller as for the command MW.

use super::noise::numbers;
use super::resource::{Answer, Deserialize, Handle, Json, Path, Problem, Serialize, View, call};
use scol_mini::ValueKind;
use serde::{Deserializer, Serializer};
use ts3100_controller::action::Action;
use ts3100_controller::queries::VariableView;
use ts3100_proto::command::Number;

/// Values a variable takes at most.
const MAX_VALUES: usize = 16;

/// A variable, or an element of an array.
#[derive(Debug, Clone, Serialize)]
#[cfg_attr(test, derive(utoipa::ToSchema), schema(as = Variable))]
pub struct VariableInfo {
    /// Name of the variable; of a variable of a program with it: `PICK.COUNT`.
    name: String,
    /// Type; absent until the first assignment fixes it.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schema(value_type = Option<KindName>))]
    kind: Option<Kind>,
    /// Upper bounds of its subscripts; empty for a plain variable.
    bounds: Vec<u32>,
    /// Value in the order of the command MR: one number, or those of a load, a coordinate, a position; absent for an
    /// array and before the first value.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schema(value_type = Option<Vec<f64>>))]
    value: Option<Vec<Number>>,
    /// The values of an array of one subscript, from 0 on, the first 1000.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schema(value_type = Option<Vec<Option<Vec<f64>>>>))]
    elements: Option<Vec<Option<Vec<Number>>>>,
}

/// Type of a variable.
#[cfg(test)]
#[derive(Serialize, utoipa::ToSchema)]
#[schema(as = VariableKind)]
#[serde(rename_all = "lowercase")]
#[expect(dead_code, reason = "the form in the document")]
enum KindName {
    Integer,
    Real,
    Load,
    Coordinate,
    Position,
}

/// A kind, written as its word.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Kind(ValueKind);

impl Serialize for Kind {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.0.word())
    }
}

/// The new value of a variable.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(test, derive(utoipa::ToSchema), schema(as = SetValue))]
#[serde(deny_unknown_fields)]
pub struct SetValueRequest {
    /// As many numbers as the type has on this arm, in the order of the command MW. A number without a decimal point
    /// fits integers and reals, one with a decimal point fits reals only. A single number needs no list.
    #[serde(deserialize_with = "one_or_several")]
    #[cfg_attr(test, schema(schema_with = values_schema))]
    value: Vec<Number>,
    /// Whether to write it into the file on the RAM drive too.
    #[serde(default)]
    #[cfg_attr(test, schema(default = false))]
    restore: bool,
}

/// A number, or a list of numbers.
#[derive(Deserialize)]
#[serde(untagged, expecting = "expected a number or a list of numbers")]
enum OneOrSeveral {
    One(Number),
    Several(Vec<Number>),
}

fn one_or_several<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<Number>, D::Error> {
    Ok(match OneOrSeveral::deserialize(deserializer)? {
        OneOrSeveral::One(figure) => vec![figure],
        OneOrSeveral::Several(figures) => figures,
    })
}

#[cfg(test)]
fn values_schema() -> utoipa::openapi::Schema {
    use utoipa::openapi::schema::{ArrayBuilder, ObjectBuilder, OneOfBuilder, Type};

    let number = || ObjectBuilder::new().schema_type(Type::Number);
    let several = ArrayBuilder::new()
        .items(number())
        .min_items(Some(1))
        .max_items(Some(MAX_VALUES));
    OneOfBuilder::new().item(number()).item(several).into()
}

/// How to teach a position.
#[derive(Debug, Clone, Copy, Deserialize)]
#[cfg_attr(test, derive(utoipa::ToSchema), schema(as = Teach))]
#[serde(deny_unknown_fields)]
pub struct TeachRequest {
    /// Whether to write it into the file on the RAM drive too.
    #[serde(default)]
    #[cfg_attr(test, schema(default = false))]
    restore: bool,
}

impl VariableInfo {
    /// All of the selected file.
    pub fn all(view: &View<'_>) -> Vec<VariableInfo> {
        let variables = view.controller.variables().into_iter();
        variables.map(VariableInfo::new).collect()
    }

    pub(super) fn new(variable: VariableView) -> VariableInfo {
        VariableInfo {
            name: variable.name,
            kind: variable.kind.map(Kind),
            bounds: variable.bounds,
            value: variable.value.map(numbers),
            elements: None,
        }
    }

    /// Whether it is a position of GLOBAL or DATA, or may become one: those of programs can only be read.
    fn can_be_taught(&self) -> bool {
        !self.name.contains('.') && self.kind.is_none_or(|kind| kind == Kind(ValueKind::Position))
    }

    /// Looks for a variable, or for a position only.
    fn find(text: String, position: bool) -> impl FnOnce(&View<'_>) -> Result<VariableInfo, Problem> {
        let expected = if position {
            "a position of GLOBAL or DATA of the selected file"
        } else {
            "a variable of the selected file, such as COUNT, A(1,2), or PICK.I of the program PICK"
        };
        let fits = move |document: &VariableInfo| !position || document.can_be_taught();
        move |view| {
            let found = view.controller.variable(&text);
            let mut document = found
                .map_err(|error| {
                    let sentence = format!("`{text}` is not the name of a variable: {error}");
                    Problem::not_found("name", expected, &text).told(sentence)
                })?
                .map(VariableInfo::new)
                .filter(&fits)
                .ok_or_else(|| Problem::not_found("name", expected, text))?;
            if let [bound] = document.bounds.as_slice() {
                let elements = view.controller.elements(&document.name, *bound);
                document.elements = Some(elements.into_iter().map(|value| value.map(numbers)).collect());
            }
            Ok(document)
        }
    }
}

async fn set(handle: &Handle, name: String, body: SetValueRequest, position: bool) -> Answer<VariableInfo> {
    if body.value.is_empty() || body.value.len() > MAX_VALUES {
        let expected = format!("1 to {MAX_VALUES} numbers");
        return Err(Problem::invalid("value", expected, body.value.len()));
    }
    let find = || VariableInfo::find(name.clone(), position);
    handle.query(find()).await??;
    let action = Action::SetVariable {
        name: name.clone(),
        values: body.value,
        restore: body.restore,
    };
    handle.act(action, find()).await?.map(Json)
}

call! {
    /// Get a variable, or an element of an array
    ///
    /// A variable of a program is that of the main task, else of the first task in which it has a value.
    get_variable = get("/variables/{name}",
        params(("name" = String, Path, description = "Name; for an element of an array with its subscripts: `A(1,2)`; for a variable of a program after the program: `PICK.COUNT`")),
        responses((status = 200, body = VariableInfo)))
}
pub async fn get_variable(handle: Handle, Path(name): Path<String>) -> Answer<VariableInfo> {
    handle.query(VariableInfo::find(name, false)).await?.map(Json)
}

call! {
    /// Set a variable
    ///
    /// As the command MW does.
    put_variable = put("/variables/{name}",
        request_body = SetValueRequest,
        params(("name" = String, Path, description = "Name; for an element of an array with its subscripts: `A(1,2)`")),
        responses((status = 200, body = VariableInfo)))
}
pub async fn put_variable(
    handle: Handle,
    Path(name): Path<String>,
    Json(body): Json<SetValueRequest>,
) -> Answer<VariableInfo> {
    set(&handle, name, body, false).await
}

call! {
    /// List the positions of the selected file
    get_positions = get("/positions",
        responses((status = 200, description = "Positions in GLOBAL and DATA.", body = Vec<VariableInfo>)))
}
pub async fn get_positions(handle: Handle) -> Answer<Vec<VariableInfo>> {
    let mut found = handle.query(VariableInfo::all).await?;
    found.retain(|document| document.kind.is_some() && document.can_be_taught());
    Ok(Json(found))
}

call! {
    /// Get a position
    get_position = get("/positions/{name}",
        params(("name" = String, Path, description = "Name of the position")),
        responses((status = 200, body = VariableInfo)))
}
pub async fn get_position(handle: Handle, Path(name): Path<String>) -> Answer<VariableInfo> {
    handle.query(VariableInfo::find(name, true)).await?.map(Json)
}

call! {
    /// Set a position
    put_position = put("/positions/{name}",
        request_body = SetValueRequest,
        params(("name" = String, Path, description = "Name of the position")),
        responses((status = 200, body = VariableInfo)))
}
pub async fn put_position(
    handle: Handle,
    Path(name): Path<String>,
    Json(body): Json<SetValueRequest>,
) -> Answer<VariableInfo> {
    set(&handle, name, body, true).await
}

call! {
    /// Teach a position
    ///
    /// Stores the current position of the arm.
    teach_position = post("/positions/{name}/teach",
        request_body = TeachRequest,
        params(("name" = String, Path, description = "Name of the position")),
        responses((status = 200, body = VariableInfo)))
}
pub async fn teach_position(
    handle: Handle,
    Path(name): Path<String>,
    Json(body): Json<TeachRequest>,
) -> Answer<VariableInfo> {
    let find = || VariableInfo::find(name.clone(), true);
    handle.query(find()).await??;
    let action = Action::Teach {
        name: name.clone(),
        restore: body.restore,
    };
    handle.act(action, find()).await?.map(Json)
}
