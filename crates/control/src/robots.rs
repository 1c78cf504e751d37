//! `/robots`: the robots of this process, and the way of a call to its robot. `/robots/NAME/...` is the whole interface
//! of one; without that prefix a call is for the only robot, or for all where that has a meaning.
//!
//! This module does not know what runs a robot; see [`Robots`].

use super::book::is_in_book;
use super::resource::{Answer, Handle, Json, Path, Problem, Serialize, call};
use axum::Extension;
use axum::extract::{FromRequestParts, Request, State};
use axum::http::StatusCode;
use axum::http::request::Parts;
use axum::http::uri::{PathAndQuery, Uri};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;
use tokio::time::timeout;
use ts3100_driver::driver::FIRST;
use ts3100_driver::driver::request::{Paused, Requests, View};
use ts3100_driver::snapshot::{SnapshotRequestError, SnapshotTask};
use ts3100_proto::words::did_you_mean;

/// Beginning of all paths of one robot.
const PREFIX: &str = "/robots/";
/// Longest wall-clock time that a call for all robots waits for one of them, while the worlds before it pause.
const MAX_GATHERING: Duration = Duration::from_secs(5);
/// Most names that a message lists.
const MAX_LISTED: usize = 8;

/// Why a robot cannot start.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct CannotStart(pub String);

/// The robots of a process.
pub trait Robots: Send + Sync {
    /// The names, in the order of the configuration.
    fn names(&self) -> Vec<String>;
    /// The name of the robot, if there is only one.
    fn only(&self) -> Option<&str>;
    /// Description of a robot, without asking it.
    fn info(&self, name: &str) -> Option<RobotInfo>;
    /// The way to a robot, which starts if it has not yet, or why it cannot; `None` if there is none of this name.
    fn start(&self, name: &str) -> Option<Result<Handle, CannotStart>>;
    /// The way to a robot that has started.
    fn running(&self, name: &str) -> Option<Handle>;
    /// The wires between them, if there are some.
    fn wires(&self) -> Option<Wires> {
        None
    }
}

/// The wires between robots.
pub struct Wires {
    /// The beginning and the end of each: `ROBOT.dout.LINE`, `ROBOT.din.LINE` or `outside.NAME`.
    pub ends: Vec<(String, String)>,
    /// The way to one of the robots that they join.
    pub handle: Handle,
}

/// A robot of this process.
#[derive(Debug, Clone, Serialize)]
#[cfg_attr(test, derive(utoipa::ToSchema), schema(as = Robot))]
pub struct RobotInfo {
    /// Name, as in `/robots/NAME/state`.
    pub name: String,
    /// Addresses of the open TCP ports.
    #[cfg_attr(test, schema(value_type = BTreeMap<String, String>))]
    pub ports: BTreeMap<String, SocketAddr>,
    /// Open serial lines: paths or URLs.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub serial: BTreeMap<String, String>,
    /// Whether it has started. A robot with an address of its own starts with its first connection or call.
    pub started: bool,
}

/// A wire.
#[derive(Debug, Clone, Serialize)]
#[cfg_attr(test, derive(utoipa::ToSchema), schema(as = Wire))]
pub struct WireInfo {
    /// Source of the level: `ROBOT.dout.LINE` or `outside.NAME`.
    pub from: String,
    /// Line that shows the level: `ROBOT.din.LINE` or `outside.NAME`.
    pub to: String,
    /// Level of the wire.
    pub on: bool,
}

/// The robots of this process.
#[derive(Debug, Clone, Serialize)]
#[cfg_attr(test, derive(utoipa::ToSchema), schema(as = Robots))]
pub struct RobotList {
    /// Robots in the order of the configuration.
    robots: Vec<RobotInfo>,
}

/// All robots, as a parameter of a handler.
pub type Fleet = Extension<Arc<dyn Robots>>;

/// Robots of a call that can be for one or for all.
pub enum Scope {
    /// For one.
    One(Handle),
    /// For each robot.
    All(Arc<dyn Robots>),
}

impl<S: Sync> FromRequestParts<S> for Scope {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, _: &S) -> Result<Scope, Problem> {
        if let Some(handle) = parts.extensions.get::<Handle>() {
            return Ok(Scope::One(handle.clone()));
        }
        let robots = parts.extensions.get().cloned();
        robots.map(Scope::All).ok_or_else(Problem::shutting_down)
    }
}

impl Scope {
    /// The robots by name, all of them started.
    pub fn started(&self) -> Result<Vec<(String, Handle)>, Problem> {
        match self {
            Scope::One(handle) => Ok(vec![(String::new(), handle.clone())]),
            Scope::All(robots) => {
                let named = |name: String| Ok((name.clone(), start(robots.as_ref(), &name)?));
                robots.names().into_iter().map(named).collect()
            }
        }
    }
}

/// Robots at one moment: their worlds pause until this is dropped.
pub struct Together {
    worlds: Vec<Paused>,
    /// The name of each robot, the place of its world, and its number there.
    robots: Vec<(String, usize, usize)>,
}

impl Together {
    /// Pauses the worlds of all robots at one moment, each once.
    pub async fn gather(robots: Vec<(String, Handle)>) -> Result<Together, Problem> {
        let mut worlds: Vec<(Requests, Paused)> = Vec::new();
        let mut places = Vec::new();
        // Every caller takes them in this order, so nobody waits for a world of somebody who waits.
        for (name, handle) in robots {
            let requests = handle.requests()?;
            // The first robot of a world comes before the others; only those have to look for it.
            let known = match requests.robot() {
                FIRST => None,
                _ => worlds.iter().position(|(taken, _)| taken.is_same_world(requests)),
            };
            let place = match known {
                Some(place) => place,
                None => {
                    let paused = timeout(MAX_GATHERING, handle.pause()).await.map_err(|_| {
                        let told = format!("cannot stop all robots at one moment: {name} is busy; try again");
                        Problem::new(StatusCode::SERVICE_UNAVAILABLE, told)
                    })??;
                    worlds.push((requests.clone(), paused));
                    worlds.len() - 1
                }
            };
            places.push((name, place, requests.robot()));
        }
        let mut worlds: Vec<Paused> = worlds.into_iter().map(|(_, paused)| paused).collect();
        if let Some(moment) = worlds.iter().map(Paused::wall).max() {
            for world in &mut worlds {
                world.stand_at(moment).await;
            }
        }
        Ok(Together {
            worlds,
            robots: places,
        })
    }

    /// States of the robots, each with its name.
    pub fn views(&self) -> impl Iterator<Item = (&str, View<'_>)> {
        let robots = self.robots.iter();
        robots.filter_map(|(name, world, robot)| Some((name.as_str(), self.worlds.get(*world)?.view(*robot))))
    }

    /// Does something about the snapshots of each robot, in the order of [`Together::views`]. Returns the first reason why
    /// one does not have all of it.
    pub async fn act_on_snapshots(&mut self, tasks: Vec<SnapshotTask>) -> Result<(), SnapshotRequestError> {
        let mut of_worlds: Vec<Vec<(usize, SnapshotTask)>> = Vec::new();
        of_worlds.resize_with(self.worlds.len(), Vec::new);
        for ((_, world, robot), task) in self.robots.iter().zip(tasks) {
            if let Some(tasks) = of_worlds.get_mut(*world) {
                tasks.push((*robot, task));
            }
        }
        let mut answer = Ok(());
        for (world, tasks) in self.worlds.iter_mut().zip(of_worlds) {
            for result in world.act_on_snapshots(tasks).await {
                answer = answer.and(result);
            }
        }
        answer
    }
}

impl<S: Sync> FromRequestParts<S> for Handle {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Handle, Problem> {
        match Scope::from_request_parts(parts, state).await? {
            Scope::One(handle) => Ok(handle),
            Scope::All(robots) => Err(robot_needed(robots.as_ref(), parts.uri.path())),
        }
    }
}

/// A call for one robot that does not say for which.
fn robot_needed(robots: &dyn Robots, path: &str) -> Problem {
    let names = robots.names();
    let example = names.first().map_or("NAME", String::as_str);
    let told = format!(
        "{path} is for one robot, and {} run here; say which: /robots/{example}{path} (ts3100 ctl --robot {example})",
        names.len()
    );
    let expected = format!("a path below /robots/{example}");
    Problem::expected_found(StatusCode::NOT_FOUND, "path", expected, path).told(told)
}

fn no_such_robot(robots: &dyn Robots, name: &str) -> Problem {
    let names = robots.names();
    let hint = did_you_mean(name, names.iter().map(String::as_str));
    let more = if names.len() > MAX_LISTED { ", ..." } else { "" };
    let listed: Vec<_> = names.iter().take(MAX_LISTED).map(String::as_str).collect();
    let expected = format!("{}{more}", listed.join(", "));
    let told = match hint.is_empty() {
        true => format!("unknown robot `{name}`: expected {expected}"),
        false => format!("unknown robot `{name}`{hint}"),
    };
    Problem::expected_found(StatusCode::NOT_FOUND, "robot", expected, name).told(told)
}

fn start(robots: &dyn Robots, name: &str) -> Result<Handle, Problem> {
    let started = robots.start(name).ok_or_else(|| no_such_robot(robots, name))?;
    started.map_err(|reason| Problem::new(StatusCode::SERVICE_UNAVAILABLE, reason).at(name))
}

/// Finds the robot of a call, before the call is looked up in the table of one robot.
pub async fn find(State(robots): State<Arc<dyn Robots>>, mut request: Request, next: Next) -> Response {
    let mut found = robots.only().map(str::to_owned);
    if let Some((name, rest)) = split_path(PREFIX, request.uri()) {
        *request.uri_mut() = rest;
        request.extensions_mut().insert(NamedInPath(name.clone()));
        found = Some(name);
    }
    if let Some(name) = found {
        // A page is served to everybody, and starts nothing.
        if !is_page(request.uri().path()) {
            match start(robots.as_ref(), &name) {
                Ok(handle) => drop(request.extensions_mut().insert(handle)),
                Err(problem) => return problem.into_response(),
            }
        }
        request.extensions_mut().insert(OfRobot);
    }
    request.extensions_mut().insert(robots);
    next.run(request).await
}

/// A call that says for which robot it is, or that needs not.
#[derive(Clone, Copy)]
pub struct OfRobot;

/// A call whose path names the robot, and that name.
#[derive(Clone)]
pub struct NamedInPath(pub String);

/// The pages ask for the token themselves and show nothing without it.
pub fn is_page(path: &str) -> bool {
    ["/", "/docs"].contains(&path) || path.starts_with("/ui/") || is_in_book(path)
}

/// The name of a robot and the path of its own that a path leads to.
pub fn own_path(path: &str) -> Option<(&str, &str)> {
    own_path_after(PREFIX, path)
}

fn own_path_after<'a>(prefix: &str, path: &'a str) -> Option<(&'a str, &'a str)> {
    let rest = path.strip_prefix(prefix)?;
    rest.split_at_checked(rest.find('/')?)
}

/// The name after a prefix, and the path below it with its query.
pub fn split_path(prefix: &str, uri: &Uri) -> Option<(String, Uri)> {
    let (name, own) = own_path_after(prefix, uri.path_and_query()?.as_str())?;
    // It is the end of a path, which can always be one.
    Some((name.to_owned(), Uri::from(PathAndQuery::try_from(own).ok()?)))
}

call! {
    /// List the robots
    get_robots = get("/robots", responses((status = 200, body = RobotList)))
}
pub async fn get_robots(Extension(robots): Fleet) -> Json<RobotList> {
    let names = robots.names();
    let robots = names.iter().filter_map(|name| robots.info(name)).collect();
    Json(RobotList { robots })
}

call! {
    /// Get the addresses of a robot
    get_robot = get("/robots/{name}",
        params(("name" = String, Path, description = "Name of the robot")),
        responses((status = 200, body = RobotInfo)))
}
pub async fn get_robot(Extension(robots): Fleet, Path(name): Path<String>) -> Answer<RobotInfo> {
    let info = robots.info(&name);
    info.map(Json)
        .ok_or_else(|| no_such_robot(robots.as_ref(), &name))
}
