//! `/channels`: the six communication ports: peers and buffers; inject bytes, drop a peer.

use super::body::{Body, InPath, NoBody, bytes_of_hex};
use super::event::hex;
use super::handle::Handle;
use super::problem::Problem;
use super::table::Table;
use super::words::PortWord;
use crate::driver::request::{LinkAction, View};
use crate::log::Readable;
use axum::Json;
use axum::extract::State;
use axum::http::StatusCode;
use serde::{Deserialize, Serialize};
use ts3100_controller::port::Port;
use ts3100_controller::queries::PortView;
use utoipa::ToSchema;

/// A communication port.
#[derive(Debug, Clone, Serialize, ToSchema)]
pub struct ChannelDoc {
    /// Its name.
    port: PortWord,
    /// The TCP port on which it accepts; absent when it does not.
    #[serde(skip_serializing_if = "Option::is_none")]
    accepts: Option<u16>,
    /// Where the host finds a serial port: a path, or an address `rfc2217://` or `socket://`.
    #[serde(skip_serializing_if = "Option::is_none")]
    serial: Option<String>,
    /// The peer, while there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    peer: Option<String>,
    /// The exchange of a protocol port: `idle`, `sending`, `receiving`.
    #[serde(skip_serializing_if = "Option::is_none")]
    exchange: Option<&'static str>,
    /// A text has begun and is not complete.
    partial: bool,
    /// What is in the ring buffer of a SCOL channel, control codes by name.
    buffer: String,
    /// The same as hexadecimal digits.
    buffer_hex: String,
}

/// Bytes: one of the two.
#[derive(Debug, Clone, Deserialize, ToSchema)]
#[serde(rename_all = "lowercase", deny_unknown_fields)]
pub enum Bytes {
    /// As text in UTF-8.
    Text(String),
    /// As hexadecimal digits.
    Hex(Digits),
}

/// Hexadecimal digits, two a byte, blanks between them allowed.
#[derive(Debug, Clone, Deserialize, ToSchema)]
#[schema(pattern = "^ *([0-9a-fA-F] *[0-9a-fA-F] *)*$")]
pub struct Digits(String);

impl Bytes {
    /// The bytes.
    pub fn read(self) -> Result<Vec<u8>, Problem> {
        match self {
            Bytes::Text(text) => Ok(text.into_bytes()),
            Bytes::Hex(Digits(text)) => bytes_of_hex(&text),
        }
    }
}

impl ChannelDoc {
    fn of(sight: &View<'_>, view: PortView) -> ChannelDoc {
        ChannelDoc {
            port: view.port.into(),
            accepts: sight.ports.get(&view.port).copied(),
            serial: sight.serial.get(&view.port).map(ToString::to_string),
            peer: view.peer,
            exchange: view.exchange,
            partial: view.partial,
            buffer: Readable(&view.buffer).to_string(),
            buffer_hex: hex(&view.buffer),
        }
    }

    /// All six, as they are now.
    pub fn all(sight: &View<'_>) -> Vec<ChannelDoc> {
        let views = sight.controller.ports().into_iter();
        views.map(|view| ChannelDoc::of(sight, view)).collect()
    }
}

/// Adds the calls of this file.
pub fn add(table: Table) -> Table {
    table
        .group(
            "channels",
            "The communication ports HOST, COM1, IP0 to IP3: peers and buffers.",
        )
        .call::<__path_get_channels, _, _>(get_channels)
        .call::<__path_get_channel, _, _>(get_channel)
        .call::<__path_inject, _, _>(inject)
        .call::<__path_drop_peer, _, _>(drop_peer)
}

/// All communication ports
#[utoipa::path(get, path = "/channels", responses((status = 200, body = Vec<ChannelDoc>)))]
async fn get_channels(State(hub): State<Handle>) -> Result<Json<Vec<ChannelDoc>>, Problem> {
    Ok(Json(hub.look(ChannelDoc::all).await?))
}

async fn channel(hub: &Handle, port: Port) -> Result<Json<ChannelDoc>, Problem> {
    let look = move |sight: &View<'_>| {
        let view = sight
            .controller
            .ports()
            .into_iter()
            .find(|view| view.port == port)?;
        Some(ChannelDoc::of(sight, view))
    };
    let found = hub.look(look).await?;
    found.map(Json).ok_or_else(|| {
        Problem::new(
            StatusCode::NOT_FOUND,
            format!("{port} is no port of this controller"),
        )
    })
}

/// One communication port
#[utoipa::path(get, path = "/channels/{port}", params(("port" = PortWord, Path, description = "Its name")),
    responses((status = 200, body = ChannelDoc)))]
async fn get_channel(
    State(hub): State<Handle>,
    InPath(port): InPath<PortWord>,
) -> Result<Json<ChannelDoc>, Problem> {
    channel(&hub, port.into()).await
}

/// Inject bytes as if they had come from the peer
///
/// On HOST and IP0 a peer must be connected, which gets the answer.
#[utoipa::path(post, path = "/channels/{port}/inject", params(("port" = PortWord, Path, description = "Its name")),
    request_body = Bytes, responses((status = 200, body = ChannelDoc)))]
async fn inject(
    State(hub): State<Handle>,
    InPath(port): InPath<PortWord>,
    Body(body): Body<Bytes>,
) -> Result<Json<ChannelDoc>, Problem> {
    let (port, bytes) = (port.into(), body.read()?);
    hub.edge(LinkAction::Inject { port, bytes }).await?;
    channel(&hub, port).await
}

/// Close the connection of a port
///
/// The port goes on accepting, or dialling.
#[utoipa::path(post, path = "/channels/{port}/drop", params(("port" = PortWord, Path, description = "Its name")),
    responses((status = 200, body = ChannelDoc)))]
async fn drop_peer(
    State(hub): State<Handle>,
    InPath(port): InPath<PortWord>,
    _: NoBody,
) -> Result<Json<ChannelDoc>, Problem> {
    let port = port.into();
    hub.edge(LinkAction::Drop { port }).await?;
    channel(&hub, port).await
}
