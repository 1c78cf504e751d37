//! `/coverage`: the cells of the permission tables that the hosts of this robot have reached.
//!
//! The record counts anyway, for the reports at the end of a run; nothing is counted for this call alone. The document is
//! that of [`ts3100_recording::reports::coverage`].

use super::resource::{Answer, Handle, Json, View, call};
use ts3100_recording::reports::CoverageReport;

/// Coverage of the permission tables, as `--coverage FILE` writes it.
#[cfg(test)]
#[derive(utoipa::ToSchema)]
#[expect(
    dead_code,
    reason = "it is only described; what is answered is `CoverageReport`"
)]
struct Coverage {
    /// Version of this document.
    version: u32,
    /// Reachable cells that were reached.
    reached: usize,
    /// Cells that the permission tables make reachable on the ports that were used; on IP0 as long as none was.
    reachable: usize,
    /// Reached cells in percent of the reachable ones, with one decimal, rounded down.
    percent: f64,
    /// All reachable cells, and all others that were reached, in the order of the tables.
    cells: Vec<CoverageCell>,
}

/// A command in a master mode on a port, and its outcome.
#[cfg(test)]
#[derive(utoipa::ToSchema)]
#[expect(
    dead_code,
    reason = "it is only described; what is answered is `CoverageReport`"
)]
struct CoverageCell {
    /// `HOST` or `IP0`.
    port: String,
    /// Row of the tables: the letters of a command, or `RS,ERR`.
    command: String,
    /// Column of the tables, a master mode: `EXT (ETHER)`.
    mode: String,
    /// `served`, `not-valid` (NG by the tables) or `refused` (NG for another reason).
    outcome: String,
    /// Number of times.
    count: u64,
    /// Whether it counts for the percentage.
    reachable: bool,
}

call! {
    /// Get the coverage of the permission tables
    ///
    /// Commands of the hosts since the start or the last reset, by master mode and outcome.
    get_coverage = get("/coverage", responses((status = 200, body = Coverage)))
}
pub async fn get_coverage(handle: Handle) -> Answer<CoverageReport> {
    let record = handle.record.clone();
    let look = move |view: &View<'_>| record.coverage_since_reset(view.controller.config());
    handle.query(look).await.map(Json)
}
