//! `/variables` and `/positions`: GLOBAL and DATA variables of the selected file: read, set, teach.
//!
//! Values are checked and stored by the controller as for the command MW.

use super::body::{JsonBody, PathParam};
use super::handle::DriverHandle;
use super::problem::Problem;
use super::route_table::RouteTable;
use axum::Json;
use axum::extract::State;
use axum::http::StatusCode;
use scol_mini::ValueKind;
use serde::{Deserialize, Deserializer, Serialize};
use ts3100_controller::action::Action;
use ts3100_controller::queries::VariableView;
use ts3100_driver::driver::request::View;
use ts3100_proto::command::Number;
use ts3100_proto::name::VariableName;
use utoipa::ToSchema;
use utoipa::openapi::schema::{ArrayBuilder, ObjectBuilder, OneOfBuilder, Schema, Type};
use utoipa_axum::routes;

/// Values a variable takes at most.
const MAX_VALUES: usize = 16;

/// A variable of GLOBAL or DATA.
#[derive(Debug, Clone, Serialize, ToSchema)]
#[schema(as = VariableDoc)]
pub struct VariableInfo {
    /// Its name.
    name: String,
    /// Its kind; absent when the first assignment will fix it.
    #[serde(skip_serializing_if = "Option::is_none")]
    kind: Option<KindName>,
    /// Upper bounds of its subscripts; empty for a plain variable.
    bounds: Vec<u32>,
    /// Its value in the order of the command MR: one number, or those of a load, a coordinate, a position; absent when
    /// it has none, or when it is an array.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Option<Vec<f64>>)]
    value: Option<Vec<JsonNumber>>,
    /// The values of an array of one subscript, from 0 on, the first 1000.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Option<Vec<Option<Vec<f64>>>>)]
    elements: Option<Vec<Option<Vec<JsonNumber>>>>,
}

/// Kind of a variable.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "lowercase")]
#[schema(as = KindWord)]
pub enum KindName {
    Integer,
    Real,
    Load,
    Coordinate,
    Position,
}

/// A number: whole without a decimal point, real with one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum JsonNumber {
    /// Within 32 bits.
    Whole(i32),
    /// Any other.
    Real(f64),
}

/// A value to be set.
#[derive(Debug, Clone, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(as = SetValue)]
pub struct SetValueRequest {
    /// As many numbers as the kind takes on this arm, in the order of the command MW. A whole number without a decimal
    /// point fits integers and reals, one with a decimal point reals only. A single number needs no list.
    #[serde(deserialize_with = "one_or_several")]
    #[schema(schema_with = values_schema)]
    value: Vec<JsonNumber>,
    /// It is written into the file of the RAM drive too.
    #[serde(default)]
    #[schema(default = false)]
    restore: bool,
}

/// A number, or a list of numbers.
#[derive(Deserialize)]
#[serde(untagged, expecting = "a number or a list of numbers expected")]
enum OneOrSeveral {
    One(JsonNumber),
    Several(Vec<JsonNumber>),
}

fn one_or_several<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<JsonNumber>, D::Error> {
    Ok(match OneOrSeveral::deserialize(deserializer)? {
        OneOrSeveral::One(figure) => vec![figure],
        OneOrSeveral::Several(figures) => figures,
    })
}

fn values_schema() -> Schema {
    let number = || ObjectBuilder::new().schema_type(Type::Number);
    let several = ArrayBuilder::new()
        .items(number())
        .min_items(Some(1))
        .max_items(Some(MAX_VALUES));
    OneOfBuilder::new().item(number()).item(several).into()
}

/// How a position is taught.
#[derive(Debug, Clone, Copy, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(as = Teach)]
pub struct TeachRequest {
    /// It is written into the file of the RAM drive too.
    #[serde(default)]
    #[schema(default = false)]
    restore: bool,
}

impl From<Number> for JsonNumber {
    fn from(number: Number) -> JsonNumber {
        match number {
            Number::Integer(whole) => JsonNumber::Whole(whole),
            Number::Real(real) => JsonNumber::Real(real),
        }
    }
}

impl From<JsonNumber> for Number {
    fn from(figure: JsonNumber) -> Number {
        match figure {
            JsonNumber::Whole(whole) => Number::Integer(whole),
            JsonNumber::Real(real) => Number::Real(real),
        }
    }
}

fn json_numbers(numbers: Vec<Number>) -> Vec<JsonNumber> {
    numbers.into_iter().map(JsonNumber::from).collect()
}

impl VariableInfo {
    fn new(variable: VariableView) -> VariableInfo {
        VariableInfo {
            name: variable.name,
            kind: variable.kind.map(|kind| match kind {
                ValueKind::Integer => KindName::Integer,
                ValueKind::Real => KindName::Real,
                ValueKind::Load => KindName::Load,
                ValueKind::Coordinate => KindName::Coordinate,
                ValueKind::Position => KindName::Position,
            }),
            bounds: variable.bounds,
            value: variable.value.map(json_numbers),
            elements: None,
        }
    }

    fn lookup(view: &View<'_>, name: &VariableName) -> Option<VariableInfo> {
        let variable = view.controller.variable(&name.name, &name.subscripts)?;
        let mut document = VariableInfo::new(variable);
        if let [bound] = document.bounds.as_slice() {
            let elements = view.controller.elements(&document.name, *bound);
            document.elements = Some(
                elements
                    .into_iter()
                    .map(|value| value.map(json_numbers))
                    .collect(),
            );
        }
        Some(document)
    }
}

async fn variable(handle: &DriverHandle, text: &str, position: bool) -> Result<Json<VariableInfo>, Problem> {
    let missing = |found: String| {
        let expected = if position {
            "a position of GLOBAL or DATA of the selected file"
        } else {
            "a variable of GLOBAL or DATA of the selected file"
        };
        Problem::not_found("name", expected, found)
    };
    let name = VariableName::parse(text).map_err(|error| missing(error.to_string()))?;
    let found = handle
        .query(move |view| VariableInfo::lookup(view, &name))
        .await?;
    let is_meant =
        |document: &VariableInfo| !position || document.kind.is_none_or(|kind| kind == KindName::Position);
    found
        .filter(is_meant)
        .map(Json)
        .ok_or_else(|| missing(text.to_owned()))
}

async fn set(
    handle: &DriverHandle,
    name: String,
    body: SetValueRequest,
    position: bool,
) -> Result<Json<VariableInfo>, Problem> {
    if body.value.is_empty() || body.value.len() > MAX_VALUES {
        let expected = format!("1 to {MAX_VALUES} numbers");
        let found = body.value.len().to_string();
        return Err(Problem::expected_found(
            StatusCode::UNPROCESSABLE_ENTITY,
            "value",
            expected,
            found,
        ));
    }
    let _known = variable(handle, &name, position).await?;
    let values = body.value.into_iter().map(Number::from).collect();
    let action = Action::SetVariable {
        name: name.clone(),
        values,
        restore: body.restore,
    };
    handle.action(action).await?;
    variable(handle, &name, position).await
}

/// Adds the calls of this file.
pub fn add(table: RouteTable) -> RouteTable {
    table
        .group(
            "variables",
            "GLOBAL and DATA of the selected file; positions among them.",
        )
        .routes(routes!(get_variables))
        .routes(routes!(get_variable))
        .routes(routes!(put_variable))
        .routes(routes!(get_positions))
        .routes(routes!(get_position))
        .routes(routes!(put_position))
        .routes(routes!(teach_position))
}

/// All of the selected file.
pub fn all(view: &View<'_>) -> Vec<VariableInfo> {
    let variables = view.controller.variables().into_iter();
    variables.map(VariableInfo::new).collect()
}

/// All variables of GLOBAL and DATA of the selected file
#[utoipa::path(get, path = "/variables", responses((status = 200, body = Vec<VariableInfo>)))]
async fn get_variables(State(handle): State<DriverHandle>) -> Result<Json<Vec<VariableInfo>>, Problem> {
    Ok(Json(handle.query(all).await?))
}

/// One variable, or an element of an array
#[utoipa::path(get, path = "/variables/{name}",
    params(("name" = String, Path, description = "Its name, for an element with subscripts: `A(1,2)`")),
    responses((status = 200, body = VariableInfo)))]
async fn get_variable(
    State(handle): State<DriverHandle>,
    PathParam(name): PathParam<String>,
) -> Result<Json<VariableInfo>, Problem> {
    variable(&handle, &name, false).await
}

/// Give a variable a value, as the command MW does
#[utoipa::path(put, path = "/variables/{name}", request_body = SetValueRequest,
    params(("name" = String, Path, description = "Its name, for an element with subscripts: `A(1,2)`")),
    responses((status = 200, body = VariableInfo)))]
async fn put_variable(
    State(handle): State<DriverHandle>,
    PathParam(name): PathParam<String>,
    JsonBody(body): JsonBody<SetValueRequest>,
) -> Result<Json<VariableInfo>, Problem> {
    set(&handle, name, body, false).await
}

/// All positions of GLOBAL and DATA of the selected file
#[utoipa::path(get, path = "/positions", responses((status = 200, body = Vec<VariableInfo>)))]
async fn get_positions(State(handle): State<DriverHandle>) -> Result<Json<Vec<VariableInfo>>, Problem> {
    let mut found = handle.query(all).await?;
    found.retain(|document| document.kind == Some(KindName::Position));
    Ok(Json(found))
}

/// One position
#[utoipa::path(get, path = "/positions/{name}", params(("name" = String, Path, description = "Its name")),
    responses((status = 200, body = VariableInfo)))]
async fn get_position(
    State(handle): State<DriverHandle>,
    PathParam(name): PathParam<String>,
) -> Result<Json<VariableInfo>, Problem> {
    variable(&handle, &name, true).await
}

/// Set a position
#[utoipa::path(put, path = "/positions/{name}", request_body = SetValueRequest,
    params(("name" = String, Path, description = "Its name")), responses((status = 200, body = VariableInfo)))]
async fn put_position(
    State(handle): State<DriverHandle>,
    PathParam(name): PathParam<String>,
    JsonBody(body): JsonBody<SetValueRequest>,
) -> Result<Json<VariableInfo>, Problem> {
    set(&handle, name, body, true).await
}

/// Teach a position: it becomes the present one of the arm
#[utoipa::path(post, path = "/positions/{name}/teach", request_body = TeachRequest,
    params(("name" = String, Path, description = "Its name")), responses((status = 200, body = VariableInfo)))]
async fn teach_position(
    State(handle): State<DriverHandle>,
    PathParam(name): PathParam<String>,
    JsonBody(body): JsonBody<TeachRequest>,
) -> Result<Json<VariableInfo>, Problem> {
    let _known = variable(&handle, &name, true).await?;
    let action = Action::Teach {
        name: name.clone(),
        restore: body.restore,
    };
    handle.action(action).await?;
    variable(&handle, &name, true).await
}
