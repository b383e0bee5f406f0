//! Collects the messages of interest by topic, and chooses among the topics.

use super::Choice;
use super::cdr::{Imu, NavSatFix, Twist};
use super::container::{self, Channel, Ending, Message, Stop, Walk};
use crate::recordings::input::Input;
use crate::recordings::session::complain;
use crate::recordings::stamped::Location;
use host_core::error::Error;
use host_core::words::counted;
use std::collections::BTreeMap;
use std::path::Path;

const IMU: &str = "sensor_msgs/msg/Imu";
const FIX: &str = "sensor_msgs/msg/NavSatFix";
const TWIST: &str = "geometry_msgs/msg/TwistStamped";
const TWIST_WITH: &str = "geometry_msgs/msg/TwistWithCovarianceStamped";

/// Messages with the time at which the recorder received them, ns.
pub(super) type Timed<M> = Vec<(i64, M)>;

/// Messages collected by topic.
pub(super) struct Topics<'a> {
    path: &'a Path,
    choice: &'a Choice,
    /// All topics of the bag.
    channels: BTreeMap<String, Channel>,
    imus: BTreeMap<String, Timed<Imu>>,
    fixes: BTreeMap<String, Timed<NavSatFix>>,
    velocities: Timed<Twist>,
}

/// The chosen topics.
pub(super) struct ChosenTopics {
    pub(super) imu: (String, Timed<Imu>),
    /// `None` if the bag has none and none was asked for.
    pub(super) fixes: Option<(String, Timed<NavSatFix>)>,
    pub(super) velocities: Timed<Twist>,
}

impl<'a> Topics<'a> {
    pub(super) fn new(path: &'a Path, choice: &'a Choice) -> Self {
        Self {
            path,
            choice,
            channels: BTreeMap::new(),
            imus: BTreeMap::new(),
            fixes: BTreeMap::new(),
            velocities: Vec::new(),
        }
    }

    /// Collects the messages of a file.
    pub(super) fn walk(&mut self, input: &mut Input<'_>) -> Result<Ending, Stop> {
        let (path, choice) = (self.path, self.choice);
        let channels = &mut self.channels;
        let (imus, fixes, velocities) = (&mut self.imus, &mut self.fixes, &mut self.velocities);
        let mut wanted = |channel: &Channel| {
            channels.insert(channel.topic.clone(), channel.clone());
            let asked = match channel.schema.as_str() {
                IMU => choice.imu.as_deref().unwrap_or(&channel.topic),
                FIX => choice.fix.as_deref().unwrap_or(&channel.topic),
                TWIST | TWIST_WITH => choice.velocity.as_deref().unwrap_or_default(),
                _ => "",
            };
            asked == channel.topic && channel.encoding == "cdr"
        };
        let mut take = |message: &Message<'_>| {
            let topic = message.channel.topic.as_str();
            let log = i64::try_from(message.log_time).unwrap_or(i64::MAX);
            let unpacked = container::unpacked(message.data);
            let data = unpacked.as_deref().unwrap_or(message.data);
            let taken = match message.channel.schema.as_str() {
                IMU => add(imus, topic, log, Imu::read(data)),
                FIX => add(fixes, topic, log, NavSatFix::read(data)),
                kind => Twist::read(data, kind == TWIST_WITH)
                    .map_err(|fault| (velocities.len(), fault))
                    .map(|t| velocities.push((log, t))),
            };
            taken.map_err(|(k, fault)| {
                let remedy = "give a bag of ROS 2, whose messages are plain CDR";
                Location::new(path, topic).complain(k, fault, remedy)
            })
        };
        Walk::new(&mut wanted, &mut take).file(input)
    }

    /// The topics asked for, or the only ones.
    ///
    /// # Errors
    /// A topic is not in the bag, is of another type, or there are several and none was named.
    pub(super) fn choose(mut self, notes: &mut Vec<String>) -> Result<ChosenTopics, Error> {
        self.check("--imu-topic", self.choice.imu.as_ref(), &[IMU])?;
        self.check("--fix-topic", self.choice.fix.as_ref(), &[FIX])?;
        let velocity = self.choice.velocity.as_ref();
        self.check("--velocity-topic", velocity, &[TWIST, TWIST_WITH])?;
        let others = self
            .channels
            .values()
            .filter(|c| [TWIST, TWIST_WITH].contains(&c.schema.as_str()));
        let others: Vec<&str> = others.map(|c| c.topic.as_str()).collect();
        if velocity.is_none() && !others.is_empty() {
            notes.push(format!(
                "{}: velocities are not read; --velocity-topic names a topic with those of the \
                 receiver, east-north-up: {}",
                self.path.display(),
                others.join(", ")
            ));
        }
        let imus = std::mem::take(&mut self.imus);
        let Some(imu) = self.only("--imu-topic", imus)? else {
            return Err(self.without_imu());
        };
        let fixes = std::mem::take(&mut self.fixes);
        Ok(ChosenTopics {
            imu,
            fixes: self.only("--fix-topic", fixes)?,
            velocities: self.velocities,
        })
    }

    /// Checks a topic that the user names.
    fn check(&self, option: &str, topic: Option<&String>, types: &[&str]) -> Result<(), Error> {
        let Some(topic) = topic else { return Ok(()) };
        let problem = match self.channels.get(topic) {
            None => format!("'{topic}' is not in {}", self.path.display()),
            Some(c) if !types.contains(&c.schema.as_str()) => {
                format!("'{topic}' has messages of type {}", c.schema)
            }
            Some(c) if c.encoding != "cdr" => {
                format!(
                    "'{topic}' is encoded as '{}', not as ROS 2 does (cdr)",
                    c.encoding
                )
            }
            Some(_) => return Ok(()),
        };
        Err(Error::Option {
            option: option.into(),
            problem,
            remedy: format!(
                "name a topic of type {}: {}",
                types.join(" or "),
                self.names(types)
            ),
        })
    }

    /// The only topic with messages, if there is one.
    fn only<M>(
        &self,
        option: &str,
        mut all: BTreeMap<String, Timed<M>>,
    ) -> Result<Option<(String, Timed<M>)>, Error> {
        let one = all.pop_first();
        if all.is_empty() {
            return Ok(one);
        }
        let first = one.iter().map(|(topic, m)| (topic, m.len()));
        let names = first.chain(all.iter().map(|(topic, m)| (topic, m.len())));
        let names: Vec<String> = names
            .map(|(t, n)| format!("{t} ({})", counted(n, "message")))
            .collect();
        Err(complain(
            self.path,
            option,
            "is needed, the bag has several topics of this type".to_owned(),
            &format!("give {option} with one of {}", names.join(", ")),
        ))
    }

    fn without_imu(&self) -> Error {
        let of_ros_1 = self.channels.values().any(|c| c.encoding == "ros1");
        let (problem, remedy) = match of_ros_1 {
            true => (
                "is a bag of ROS 1, which is not read".to_owned(),
                "convert it to ROS 2 with 'rosbags-convert' (Python package rosbags)".to_owned(),
            ),
            false => (
                "is not among the messages".to_owned(),
                format!(
                    "record a topic of this type; the bag has {}",
                    self.names(&[])
                ),
            ),
        };
        complain(self.path, IMU, problem, &remedy)
    }

    /// The topics of these types, or all.
    fn names(&self, types: &[&str]) -> String {
        let all = self.channels.values();
        let of_type = all.filter(|c| types.is_empty() || types.contains(&c.schema.as_str()));
        let names: Vec<String> = of_type
            .map(|c| format!("{} ({})", c.topic, c.schema))
            .collect();
        match names.is_empty() {
            true => "there is none".into(),
            false => names.join(", "),
        }
    }
}

/// Adds a message to its topic, or returns its number and fault.
fn add<M>(
    all: &mut BTreeMap<String, Timed<M>>,
    topic: &str,
    log: i64,
    message: Result<M, String>,
) -> Result<(), (usize, String)> {
    if !all.contains_key(topic) {
        all.insert(topic.to_owned(), Vec::new());
    }
    let Some(messages) = all.get_mut(topic) else {
        return Ok(());
    };
    let message = message.map_err(|fault| (messages.len(), fault))?;
    messages.push((log, message));
    Ok(())
}
