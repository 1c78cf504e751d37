//! `/channels`: the six communication ports with their peers and buffers; inject bytes, drop a peer.
//!
//! The sockets are in [`ts3100_driver::tcp`] and [`ts3100_driver::serial`]; the buffers are the controller's.

use super::api_names::{NamedPort, PortName};
use super::body::parse_hex;
use super::resource::{Answer, Deserialize, Handle, Json, NoBody, Path, Problem, Serialize, View, call};
use ts3100_controller::port::Port;
use ts3100_controller::queries::PortView;
use ts3100_driver::driver::request::{LinkAction, Request};
use ts3100_proto::escape::{Escaped, hex_digits};

/// A communication port.
#[derive(Debug, Clone, Serialize)]
#[cfg_attr(test, derive(utoipa::ToSchema), schema(as = Channel))]
pub struct ChannelStatus {
    /// Name of the port.
    #[serde(with = "PortName")]
    #[cfg_attr(test, schema(value_type = PortName))]
    port: Port,
    /// TCP port on which it accepts connections; absent if it accepts none.
    #[serde(skip_serializing_if = "Option::is_none")]
    accepts: Option<u16>,
    /// Where the host finds a serial port: a path, or an address `rfc2217://` or `socket://`.
    #[serde(skip_serializing_if = "Option::is_none")]
    serial: Option<String>,
    /// Address of the connected peer; absent without a peer.
    #[serde(skip_serializing_if = "Option::is_none")]
    peer: Option<String>,
    /// The exchange of a protocol port: `idle`, `sending`, `receiving`.
    #[serde(skip_serializing_if = "Option::is_none")]
    exchange: Option<&'static str>,
    /// Whether a text has begun and is incomplete.
    partial: bool,
    /// Content of the ring buffer of a SCOL channel, control codes by name.
    buffer: String,
    /// The same as hexadecimal digits.
    buffer_hex: String,
}

/// Bytes, as text or as hexadecimal digits.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(test, derive(utoipa::ToSchema), schema(as = Bytes))]
#[serde(rename_all = "lowercase", deny_unknown_fields)]
pub enum ByteContent {
    /// As text in UTF-8.
    Text(String),
    /// As hexadecimal digits.
    Hex(HexDigits),
}

/// Hexadecimal digits, two a byte, blanks between them allowed.
#[derive(Debug, Clone, Deserialize)]
#[cfg_attr(test, derive(utoipa::ToSchema), schema(as = HexDigits, pattern = "^ *([0-9a-fA-F] *[0-9a-fA-F] *)*$"))]
pub struct HexDigits(String);

impl ByteContent {
    /// The bytes.
    pub fn decode(self) -> Result<Vec<u8>, Problem> {
        match self {
            ByteContent::Text(text) => Ok(text.into_bytes()),
            ByteContent::Hex(HexDigits(text)) => parse_hex(&text),
        }
    }
}

impl ChannelStatus {
    fn new(view: &View<'_>, port: Port) -> ChannelStatus {
        let PortView {
            exchange,
            partial,
            buffer,
        } = view.controller.port(port);
        ChannelStatus {
            port,
            accepts: view.ports.get(&port).copied(),
            serial: view.serial_lines.endpoint(port).map(ToString::to_string),
            peer: view.controller.peer(port).map(str::to_owned),
            exchange,
            partial,
            buffer: Escaped::for_reading(&buffer).to_string(),
            buffer_hex: hex_digits(&buffer),
        }
    }

    /// Reads the present state of all six.
    pub fn all(view: &View<'_>) -> Vec<ChannelStatus> {
        let ports = Port::ALL.into_iter();
        ports.map(|port| ChannelStatus::new(view, port)).collect()
    }
}

call! {
    /// Get a communication port
    get_channel = get("/channels/{port}",
        params(("port" = PortName, Path, description = "Name of the port")),
        responses((status = 200, body = ChannelStatus)))
}
pub async fn get_channel(handle: Handle, Path(NamedPort(port)): Path<NamedPort>) -> Answer<ChannelStatus> {
    let look = move |view: &View<'_>| ChannelStatus::new(view, port);
    handle.query(look).await.map(Json)
}

async fn act_on_link(handle: &Handle, port: Port, action: LinkAction) -> Answer<ChannelStatus> {
    let look = move |view: &View<'_>| ChannelStatus::new(view, port);
    handle.change(Request::LinkAction, action, look).await.map(Json)
}

call! {
    /// Inject bytes as if they had come from the peer
    ///
    /// On HOST and IP0 a peer must be connected; it gets the answer.
    inject = post("/channels/{port}/inject",
        operation_id = "inject_bytes",
        params(("port" = PortName, Path, description = "Name of the port")),
        request_body = ByteContent,
        responses((status = 200, body = ChannelStatus)))
}
pub async fn inject(
    handle: Handle,
    Path(NamedPort(port)): Path<NamedPort>,
    Json(body): Json<ByteContent>,
) -> Answer<ChannelStatus> {
    let bytes = body.decode()?;
    let action = LinkAction::Inject { port, bytes };
    act_on_link(&handle, port, action).await
}

call! {
    /// Close the connection of a port
    ///
    /// The port keeps accepting, or dialling.
    drop_peer = post("/channels/{port}/drop",
        params(("port" = PortName, Path, description = "Name of the port")),
        responses((status = 200, body = ChannelStatus)))
}
pub async fn drop_peer(
    handle: Handle,
    Path(NamedPort(port)): Path<NamedPort>,
    _: NoBody,
) -> Answer<ChannelStatus> {
    act_on_link(&handle, port, LinkAction::Drop { port }).await
}
