//! Texts and bytes on their way out: framed like the host's last text, passed through the filters, and written at once
//! or when their time has come.
//!
//! `exchange` and `ops` decide the answer, `filters` applies faults and variation to it. `send_queue` holds bytes that leave
//! later, `serial_lines` those that take time on the line.

use crate::context::Context;
use crate::endpoint::Endpoints;
use crate::limits::{MAX_QUEUED_BYTES, MAX_QUEUED_SEGMENTS, MAX_SEND};
use crate::output::{Event, Output};
use crate::port::Port;
use crate::prelude::*;
use crate::segment::{Departure, Segment};
use crate::time::Time;
use bytes::Bytes;
use core::time::Duration;
use ts3100_proto::reply::{Reply, STOP};
use ts3100_proto::text::{Framing, encode_text};

impl Endpoints {
    /// Sends a text, framed like the host's last one: an answer, or the unsolicited SP.
    pub(crate) fn send_text(&mut self, context: &mut Context, port: Port, data: &[u8]) {
        let session = self.session(port);
        if session.peer.is_none() {
            return;
        }
        let framing = session.framing;
        let bytes = Bytes::from(encode_text(data, framing, context.config.options.text.checksum));
        debug_assert!(bytes.len() <= MAX_SEND);
        let begin = usize::from(framing == Framing::Stx);
        let section = bytes.slice(begin..begin + data.len());
        context.outputs.event(Event::TextOut {
            port,
            framing,
            data: section.clone(),
        });
        let sent = self.send(context, port, bytes, &section);
        let session = self.session(port);
        session.sent_at = Some(sent);
        session.history.unsolicited_sp_sent = data == STOP;
        if Reply::acknowledges(data) {
            session.replied(sent);
        }
    }

    /// Sends OK.
    pub(crate) fn acknowledge(&mut self, context: &mut Context, port: Port) {
        self.send_text(context, port, &Reply::Ok.encode());
    }

    /// Sends the bytes of a text or of PRINT, at once, or as the filters change them and after what waits on the port. `data`
    /// is the data section; PRINT has no framing, so there it is all bytes. Returns when the last byte is sent, as far as known.
    pub(crate) fn send(&mut self, context: &mut Context, port: Port, bytes: Bytes, data: &Bytes) -> Time {
        if port.protocol().is_none() {
            context.fault_effects.next_record(port);
        }
        let changes = self.changes_output(context);
        // What is queued already leaves first, even after its fault is gone: a port never reorders its bytes.
        if !changes && !self.send_queue.is_busy(port) {
            return self.write(context, port, bytes);
        }
        let segments = match changes {
            true => self.outbound(context, port, bytes, data),
            false => Vec::from([Segment::bytes(bytes)]),
        };
        if let [
            Segment {
                delay: Duration::ZERO,
                departure: Departure::Bytes(bytes),
            },
        ] = segments.as_slice()
            && !self.send_queue.is_busy(port)
        {
            return self.write(context, port, bytes.clone());
        }
        let mut last = context.now;
        for segment in segments {
            let surplus = segment.departure.length();
            let (bytes, segments) = self.send_queue.waiting(port);
            // A fault may delay a port by any time: without a bound a program that prints on would fill the memory.
            if bytes + surplus > MAX_QUEUED_BYTES || segments >= MAX_QUEUED_SEGMENTS {
                context.dropped(port, surplus, "more is to be sent than a delayed port holds");
                continue;
            }
            last = self.send_queue.push(port, last, segment);
        }
        self.send_due(context);
        last
    }

    /// Sends the segments that are due.
    pub(crate) fn send_due(&mut self, context: &mut Context) {
        while let Some((port, what)) = self.send_queue.take_due(context.now) {
            match what {
                Departure::Bytes(bytes) | Departure::Held(bytes) if bytes.is_empty() => {}
                Departure::Bytes(bytes) | Departure::Held(bytes) => {
                    self.write(context, port, bytes);
                }
                // The edge keeps the connection open and reads nothing more: the peer is half-open.
                Departure::Stall => {
                    self.faults.stall(port);
                    if port.ethernet_index().is_some() {
                        context.outputs.push(Output::Stall { port });
                    }
                }
                // A serial line has no connection to end.
                Departure::Disconnect(_) if port.ethernet_index().is_none() => self.faults.forget_peer(port),
                Departure::Disconnect(how) => {
                    // Send nothing more until the embedding program reports that the peer is gone.
                    self.faults.stall(port);
                    self.send_queue.clear(port);
                    context.outputs.push(Output::Disconnect { port, how });
                }
            }
        }
    }

    /// Bytes leave the robot. Returns when the last of them is out: on Ethernet at once.
    fn write(&mut self, context: &mut Context, port: Port, bytes: Bytes) -> Time {
        if self.lines.contains_key(&port) {
            return self.put_on_line(context, port, bytes);
        }
        context.outputs.push(Output::Send { port, bytes });
        context.now
    }
}
