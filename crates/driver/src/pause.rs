//! A pause of less than a millisecond. The timer of the runtime counts whole ones, which is enough for everything but a
//! shorter silence before a jump of [`TimeMode::Auto`](crate::clock::TimeMode::Auto) (option `auto.silence`).

#[cfg(target_os = "linux")]
use std::future::poll_fn;
use std::time::Duration;

/// Ends after this time, on Linux within a few microseconds.
pub(crate) async fn pause(time: Duration) {
    #[cfg(target_os = "linux")]
    if precise(time).await.is_ok() {
        return;
    }
    tokio::time::sleep(time).await;
}

#[cfg(target_os = "linux")]
#[expect(
    deprecated,
    reason = "the other constructor is unsafe; the descriptor is owned and stays open"
)]
async fn precise(time: Duration) -> std::io::Result<()> {
    use rustix::time::{
        Itimerspec, TimerfdClockId, TimerfdFlags, TimerfdTimerFlags, Timespec, timerfd_create,
        timerfd_settime,
    };
    use tokio::io::Interest;
    use tokio::io::unix::AsyncFd;

    let flags = TimerfdFlags::NONBLOCK | TimerfdFlags::CLOEXEC;
    let timer = timerfd_create(TimerfdClockId::Monotonic, flags)?;
    let timer = AsyncFd::with_interest(timer, Interest::READABLE)?;
    let once = Itimerspec {
        it_interval: Timespec::default(),
        // A timer of no time would never end.
        it_value: Timespec::try_from(time.max(Duration::from_nanos(1))).map_err(std::io::Error::other)?,
    };
    timerfd_settime(&timer, TimerfdTimerFlags::empty(), &once)?;
    let _expired = poll_fn(|context| timer.poll_read_ready(context)).await?;
    Ok(())
}
