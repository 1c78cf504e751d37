//! `/variables` and `/positions`: GLOBAL and DATA of the selected file: read, set, teach.

use super::body::{Body, InPath};
use super::handle::Handle;
use super::problem::Problem;
use super::table::Table;
use crate::driver::request::View;
use axum::Json;
use axum::extract::State;
use axum::http::StatusCode;
use scol_mini::ValueKind;
use serde::{Deserialize, Deserializer, Serialize};
use ts3100_controller::action::Action;
use ts3100_controller::queries::VariableView;
use ts3100_proto::command::Number;
use ts3100_proto::name::VariableName;
use utoipa::ToSchema;
use utoipa::openapi::schema::{ArrayBuilder, ObjectBuilder, OneOfBuilder, Schema, Type};

/// Values a variable takes at most.
const MAX_VALUES: usize = 16;

/// A variable of GLOBAL or DATA.
#[derive(Debug, Clone, Serialize, ToSchema)]
pub struct VariableDoc {
    /// Its name.
    name: String,
    /// Its kind; absent when the first assignment will fix it.
    #[serde(skip_serializing_if = "Option::is_none")]
    kind: Option<KindWord>,
    /// Upper bounds of its subscripts; empty for a plain variable.
    bounds: Vec<u32>,
    /// Its value in the order of the command MR: one number, or those of a load, a coordinate, a position; absent when
    /// it has none, or when it is an array.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Option<Vec<f64>>)]
    value: Option<Vec<Figure>>,
    /// The values of an array of one subscript, from 0 on, the first 1000.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Option<Vec<Option<Vec<f64>>>>)]
    elements: Option<Vec<Option<Vec<Figure>>>>,
}

/// Kind of a variable.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "lowercase")]
pub enum KindWord {
    Integer,
    Real,
    Load,
    Coordinate,
    Position,
}

/// A number: whole without a decimal point, real with one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Figure {
    /// Within 32 bits.
    Whole(i32),
    /// Any other.
    Real(f64),
}

/// A value to be set.
#[derive(Debug, Clone, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct SetValue {
    /// As many numbers as the kind takes on this arm, in the order of the command MW. A whole number without a decimal
    /// point fits integers and reals, one with a decimal point reals only. A single number needs no list.
    #[serde(deserialize_with = "one_or_several")]
    #[schema(schema_with = values_schema)]
    value: Vec<Figure>,
    /// It is written into the file of the RAM drive too.
    #[serde(default)]
    #[schema(default = false)]
    restore: bool,
}

/// A number, or a list of numbers.
#[derive(Deserialize)]
#[serde(untagged, expecting = "a number or a list of numbers expected")]
enum Values {
    One(Figure),
    Several(Vec<Figure>),
}

fn one_or_several<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<Figure>, D::Error> {
    Ok(match Values::deserialize(deserializer)? {
        Values::One(figure) => vec![figure],
        Values::Several(figures) => figures,
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
pub struct Teach {
    /// It is written into the file of the RAM drive too.
    #[serde(default)]
    #[schema(default = false)]
    restore: bool,
}

impl From<Number> for Figure {
    fn from(number: Number) -> Figure {
        match number {
            Number::Integer(whole) => Figure::Whole(whole),
            Number::Real(real) => Figure::Real(real),
        }
    }
}

impl From<Figure> for Number {
    fn from(figure: Figure) -> Number {
        match figure {
            Figure::Whole(whole) => Number::Integer(whole),
            Figure::Real(real) => Number::Real(real),
        }
    }
}

fn figures(numbers: Vec<Number>) -> Vec<Figure> {
    numbers.into_iter().map(Figure::from).collect()
}

impl VariableDoc {
    fn of(view: VariableView) -> VariableDoc {
        VariableDoc {
            name: view.name,
            kind: view.kind.map(|kind| match kind {
                ValueKind::Integer => KindWord::Integer,
                ValueKind::Real => KindWord::Real,
                ValueKind::Load => KindWord::Load,
                ValueKind::Coordinate => KindWord::Coordinate,
                ValueKind::Position => KindWord::Position,
            }),
            bounds: view.bounds,
            value: view.value.map(figures),
            elements: None,
        }
    }

    fn one(sight: &View<'_>, name: &VariableName) -> Option<VariableDoc> {
        let view = sight.controller.variable(&name.name, &name.subscripts)?;
        let mut document = VariableDoc::of(view);
        if let [bound] = document.bounds.as_slice() {
            let elements = sight.controller.elements(&document.name, *bound);
            document.elements = Some(elements.into_iter().map(|value| value.map(figures)).collect());
        }
        Some(document)
    }
}

async fn variable(hub: &Handle, text: &str, position: bool) -> Result<Json<VariableDoc>, Problem> {
    let missing = |found: String| {
        let expected = if position {
            "a position of GLOBAL or DATA of the selected file"
        } else {
            "a variable of GLOBAL or DATA of the selected file"
        };
        Problem::missing("name", expected, found)
    };
    let name = VariableName::parse(text).map_err(|error| missing(error.to_string()))?;
    let found = hub.look(move |sight| VariableDoc::one(sight, &name)).await?;
    let is_meant =
        |document: &VariableDoc| !position || document.kind.is_none_or(|kind| kind == KindWord::Position);
    found
        .filter(is_meant)
        .map(Json)
        .ok_or_else(|| missing(text.to_owned()))
}

async fn set(
    hub: &Handle,
    name: String,
    body: SetValue,
    position: bool,
) -> Result<Json<VariableDoc>, Problem> {
    if body.value.is_empty() || body.value.len() > MAX_VALUES {
        let expected = format!("1 to {MAX_VALUES} numbers");
        let found = body.value.len().to_string();
        return Err(Problem::at(
            StatusCode::UNPROCESSABLE_ENTITY,
            "value",
            expected,
            found,
        ));
    }
    let _known = variable(hub, &name, position).await?;
    let values = body.value.into_iter().map(Number::from).collect();
    let action = Action::SetVariable {
        name: name.clone(),
        values,
        restore: body.restore,
    };
    hub.action(action).await?;
    variable(hub, &name, position).await
}

/// Adds the calls of this file.
pub fn add(table: Table) -> Table {
    table
        .group(
            "variables",
            "GLOBAL and DATA of the selected file; positions among them.",
        )
        .call::<__path_get_variables, _, _>(get_variables)
        .call::<__path_get_variable, _, _>(get_variable)
        .call::<__path_put_variable, _, _>(put_variable)
        .call::<__path_get_positions, _, _>(get_positions)
        .call::<__path_get_position, _, _>(get_position)
        .call::<__path_put_position, _, _>(put_position)
        .call::<__path_teach_position, _, _>(teach_position)
}

/// All of the selected file.
pub fn all(sight: &View<'_>) -> Vec<VariableDoc> {
    let views = sight.controller.variables().into_iter();
    views.map(VariableDoc::of).collect()
}

/// All variables of GLOBAL and DATA of the selected file
#[utoipa::path(get, path = "/variables", responses((status = 200, body = Vec<VariableDoc>)))]
async fn get_variables(State(hub): State<Handle>) -> Result<Json<Vec<VariableDoc>>, Problem> {
    Ok(Json(hub.look(all).await?))
}

/// One variable, or an element of an array
#[utoipa::path(get, path = "/variables/{name}",
    params(("name" = String, Path, description = "Its name, for an element with subscripts: `A(1,2)`")),
    responses((status = 200, body = VariableDoc)))]
async fn get_variable(
    State(hub): State<Handle>,
    InPath(name): InPath<String>,
) -> Result<Json<VariableDoc>, Problem> {
    variable(&hub, &name, false).await
}

/// Give a variable a value, as the command MW does
#[utoipa::path(put, path = "/variables/{name}", request_body = SetValue,
    params(("name" = String, Path, description = "Its name, for an element with subscripts: `A(1,2)`")),
    responses((status = 200, body = VariableDoc)))]
async fn put_variable(
    State(hub): State<Handle>,
    InPath(name): InPath<String>,
    Body(body): Body<SetValue>,
) -> Result<Json<VariableDoc>, Problem> {
    set(&hub, name, body, false).await
}

/// All positions of GLOBAL and DATA of the selected file
#[utoipa::path(get, path = "/positions", responses((status = 200, body = Vec<VariableDoc>)))]
async fn get_positions(State(hub): State<Handle>) -> Result<Json<Vec<VariableDoc>>, Problem> {
    let mut found = hub.look(all).await?;
    found.retain(|document| document.kind == Some(KindWord::Position));
    Ok(Json(found))
}

/// One position
#[utoipa::path(get, path = "/positions/{name}", params(("name" = String, Path, description = "Its name")),
    responses((status = 200, body = VariableDoc)))]
async fn get_position(
    State(hub): State<Handle>,
    InPath(name): InPath<String>,
) -> Result<Json<VariableDoc>, Problem> {
    variable(&hub, &name, true).await
}

/// Set a position
#[utoipa::path(put, path = "/positions/{name}", request_body = SetValue,
    params(("name" = String, Path, description = "Its name")), responses((status = 200, body = VariableDoc)))]
async fn put_position(
    State(hub): State<Handle>,
    InPath(name): InPath<String>,
    Body(body): Body<SetValue>,
) -> Result<Json<VariableDoc>, Problem> {
    set(&hub, name, body, true).await
}

/// Teach a position: it becomes the present one of the arm
#[utoipa::path(post, path = "/positions/{name}/teach", request_body = Teach,
    params(("name" = String, Path, description = "Its name")), responses((status = 200, body = VariableDoc)))]
async fn teach_position(
    State(hub): State<Handle>,
    InPath(name): InPath<String>,
    Body(body): Body<Teach>,
) -> Result<Json<VariableDoc>, Problem> {
    let _known = variable(&hub, &name, true).await?;
    let action = Action::Teach {
        name: name.clone(),
        restore: body.restore,
    };
    hub.action(action).await?;
    variable(&hub, &name, true).await
}
