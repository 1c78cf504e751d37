//! Faults and legal variation, applied to the bytes, texts and commands that pass a port. Without them bytes and texts do
//! not pass here at all, and the protocol (`exchange`, `download`, `session`) is complete without this file.
//!
//! `faults` decides which fault fires and what it changes, `variation` draws what varies.

use super::Endpoints;
use crate::action::ActionError;
use crate::action_error::ActionResult;
use crate::context::Context;
use crate::faults::kind::{Effect, FaultSite};
use crate::faults::rng::Rng;
use crate::faults::{FaultAction, InjectionPoint, RecordState};
use crate::limits::MAX_FAULTS;
use crate::output::Event;
use crate::port::Port;
use crate::prelude::*;
use crate::refusal::Refusal;
use crate::segment::{Departure, Segment};
use bytes::Bytes;
use core::time::Duration;
use ts3100_proto::file::FlSender;
use ts3100_proto::reply::STOP;
use ts3100_proto::text::CR;

impl Endpoints {
    /// Bytes of a peer as the robot gets them; `None` where nothing is read.
    pub(super) fn inbound(&mut self, context: &mut Context, port: Port, bytes: &Bytes) -> Option<Bytes> {
        if self.faults.is_stalled(port) {
            return None;
        }
        let site = FaultSite::new(InjectionPoint::Bytes, port, bytes.clone());
        let mut came = bytes.clone();
        if let Effect::ReplaceInput(instead) = self.apply_fault(context, &site) {
            came = instead;
        }
        Some(match port {
            Port::Com1 | Port::Ip1 | Port::Ip2 => self.drop_lost_records(context, port, came),
            Port::Host | Port::Ip0 | Port::Ip3 => came,
        })
    }

    /// The place of the character off a serial line that has a parity error on purpose.
    pub(super) fn parity_error(&mut self, context: &mut Context, port: Port, bytes: &[u8]) -> Option<usize> {
        if self.faults.is_empty() {
            return None;
        }
        let characters = Bytes::copy_from_slice(bytes);
        let site = FaultSite::new(InjectionPoint::Character, port, characters);
        let Effect::ParityError(place) = self.apply_fault(context, &site) else {
            return None;
        };
        Some(place).filter(|place| *place < bytes.len())
    }

    /// Bytes received on a SCOL channel, without the records that a fault drops.
    fn drop_lost_records(&mut self, context: &mut Context, port: Port, bytes: Bytes) -> Bytes {
        if self.faults.is_empty() {
            return bytes;
        }
        let mut kept = Vec::new();
        for byte in bytes {
            let record = FaultSite::new(InjectionPoint::Record, port, Bytes::new());
            // A record may come in several segments: its first byte decides about all of them.
            let state = match self.faults.records.get(&port).copied() {
                Some(state) => state,
                // Line ends and blanks between records belong to none.
                None if matches!(byte, b'\r' | b'\n' | b' ') => {
                    kept.push(byte);
                    continue;
                }
                None if self.apply_fault(context, &record) == Effect::Lost => RecordState::Lost,
                None => RecordState::Kept,
            };
            if state == RecordState::Kept {
                kept.push(byte);
            }
            if byte == CR {
                self.faults.records.remove(&port);
            } else {
                self.faults.records.insert(port, state);
            }
        }
        kept.into()
    }

    /// Whether a command, or a text of a download, reaches the robot; `data` is the text. It is answered here if not.
    pub(super) fn admit(&mut self, context: &mut Context, port: Port, data: &[u8]) -> bool {
        let session = self.session(port);
        let (command, block) = (session.asked, session.block);
        if block == 0 {
            self.faults.drive_free = None;
        }
        let site = FaultSite {
            command,
            block,
            ..FaultSite::new(InjectionPoint::Command, port, Bytes::new())
        };
        let effect = self.apply_fault(context, &site);
        if let Effect::Refused(reason) = &effect {
            let reason = &Refusal::OnPurpose(reason.clone());
            match block {
                0 => self.refuse_text(context, port, command, reason),
                _ => self.refuse_block(context, port, data, reason),
            }
        }
        !matches!(effect, Effect::Lost | Effect::Refused(_))
    }

    /// Where a file that is about to be sent is cut into texts.
    pub(super) fn cut(&mut self, sender: &mut FlSender) {
        if let (Some(variation), Some(length)) = (&mut self.variation, sender.remaining_to_split()) {
            sender.set_text_lengths(variation.cuts(length));
        }
    }

    /// Whether a fault, variation or option `reply.delay` can change the bytes sent or their time.
    pub(super) fn changes_output(&self, context: &Context) -> bool {
        let delays = &context.config.options.reply_delay;
        !self.faults.are_quiet() || self.variation.is_some() || delays.iter().any(|delay| !delay.is_zero())
    }

    /// Segments that leave when a text, or data of PRINT, is sent. `data` is the data section of the text.
    pub(super) fn outbound(
        &mut self,
        context: &mut Context,
        port: Port,
        bytes: Bytes,
        data: &Bytes,
    ) -> Vec<Segment> {
        let is_stop = *data == STOP;
        let (point, command, block) = match self.sessions.get(&port) {
            None => (InjectionPoint::Print, "", 0),
            Some(_) if is_stop => (InjectionPoint::Reply, "SP", 0),
            Some(session) => (InjectionPoint::Reply, session.asked, session.block),
        };
        // SP is no answer: `announce_stop()` has drawn its delay already.
        let answers = point == InjectionPoint::Reply && !is_stop;
        let varied = match &mut self.variation {
            Some(variation) if answers => variation.reply_delay(),
            _ => Duration::ZERO,
        };
        let delay = match answers {
            true => varied + reply_delay(context),
            false => Duration::ZERO,
        };
        if self.faults.is_stalled(port) {
            return Vec::new();
        }
        let site = FaultSite {
            point,
            port,
            command,
            block,
            bytes: bytes.clone(),
            data: data.clone(),
        };
        match (self.apply_fault(context, &site), &mut self.variation) {
            (Effect::Lost, _) => Vec::new(),
            (Effect::ReplaceOutput(segments), _) => segments,
            (_, Some(variation)) => variation.segments(delay, &bytes),
            (_, None) if delay.is_zero() => [Segment::bytes(bytes)].into(),
            (_, None) => [Segment::after(delay, Departure::Bytes(bytes))].into(),
        }
    }

    /// Drops queued output and fault state of the previous peer.
    pub(crate) fn forget_peer(&mut self, port: Port) {
        self.send_queue.clear(port);
        self.faults.forget_peer(port);
    }

    /// Arms or disarms faults.
    ///
    /// # Errors
    /// Why it had no effect.
    pub(crate) fn fault_order(&mut self, context: &mut Context, action: FaultAction) -> ActionResult {
        match action {
            FaultAction::Arm(fault) => {
                let (kind, spec) = (fault.kind.name, fault.to_string());
                fault
                    .check_can_fire()
                    .and_then(|()| fault.check_possible_on(context.config.controller))
                    .map_err(|error| ActionError::conflict(&spec, error))?;
                let id = self.faults.arm(*fault).ok_or_else(|| {
                    let reason = format!("cannot arm {spec}: {MAX_FAULTS} faults are armed already");
                    ActionError::conflict(&spec, reason)
                })?;
                context.outputs.event(Event::Fault {
                    id,
                    kind,
                    port: None,
                    message: format!("armed: {spec}"),
                    fired: false,
                });
                Ok(())
            }
            FaultAction::Disarm(id) if self.faults.disarm(id) => Ok(()),
            FaultAction::Disarm(id) => Err(ActionError::missing("fault", format!("there is no fault {id}"))),
            FaultAction::Clear => {
                self.faults.clear();
                Ok(())
            }
        }
    }

    /// Lets at most one armed fault fire at a site; returns its change.
    fn apply_fault(&mut self, context: &mut Context, site: &FaultSite<'_>) -> Effect {
        let fired = self.faults.fire(context.now, site, &mut context.fault_effects);
        let Some((effect, at_once, event)) = fired else {
            return Effect::Unchanged;
        };
        // The event of a fault that acts on the machine comes after the events of its effect (`perform_fired()`).
        if at_once.is_empty() {
            context.outputs.event(event);
        } else {
            self.fired.push((at_once, event));
        }
        effect
    }
}

/// Delay of this answer by option `reply.delay`: one of the quarters between its five times, each as likely as the others,
/// and a time within it. The seed is the present time, so no generator has to be kept in snapshots.
fn reply_delay(context: &Context) -> Duration {
    let times = &context.config.options.reply_delay;
    let [.., greatest] = times;
    if greatest.is_zero() {
        return Duration::ZERO;
    }
    let mut rng = Rng::new(context.config.fault_seed ^ context.now.as_micros(), "reply.delay");
    let quarter = rng.index(times.len() - 1);
    let micros = |index: usize| {
        let time = times.get(index).copied().unwrap_or_default();
        u64::try_from(time.as_micros()).unwrap_or(u64::MAX)
    };
    Duration::from_micros(rng.between(micros(quarter), micros(quarter + 1)))
}
