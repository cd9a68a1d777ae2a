//! The services that every node has, six for its parameters and one for types, and its news on `/parameter_events`.

use swath_msgs::rcl_interfaces::{
    DescribeParameters, DescribeParametersResponse, GetParameterTypes, GetParameterTypesResponse, GetParameters,
    GetParametersResponse, ListParameters, ListParametersRequest, ListParametersResponse, ListParametersResult,
    Parameter, ParameterDescriptor, ParameterEvent, ParameterType, ParameterValue, SetParameters,
    SetParametersAtomically, SetParametersAtomicallyResponse, SetParametersResponse, SetParametersResult,
};
use swath_msgs::type_description_interfaces::GetTypeDescription;

use crate::clock::SimClock;
use crate::error::RosError;
use crate::params::Parameters;
use crate::service::Server;
use crate::signal::Signal;
use crate::topic::Publisher;
use crate::type_description;
use crate::value::Value;

/// The servers, and the publisher of changes.
pub(crate) struct NodeServices {
    pub(crate) node: String,
    pub(crate) parameters: Parameters,
    pub(crate) clock: SimClock,
    pub(crate) describe: Server<DescribeParameters>,
    pub(crate) get: Server<GetParameters>,
    pub(crate) get_types: Server<GetParameterTypes>,
    pub(crate) list: Server<ListParameters>,
    pub(crate) set: Server<SetParameters>,
    pub(crate) set_atomically: Server<SetParametersAtomically>,
    pub(crate) describe_type: Server<GetTypeDescription>,
    pub(crate) events: Publisher<ParameterEvent>,
}

impl NodeServices {
    pub(crate) fn set_signal(&mut self, signal: &Signal) {
        self.describe.set_signal(signal);
        self.get.set_signal(signal);
        self.get_types.set_signal(signal);
        self.list.set_signal(signal);
        self.set.set_signal(signal);
        self.set_atomically.set_signal(signal);
        self.describe_type.set_signal(signal);
    }

    /// Answers what has been asked, and tells of what has changed.
    pub(crate) fn serve(&self) -> Result<(), RosError> {
        let parameters = &self.parameters;
        self.describe.answer_all(|request| DescribeParametersResponse {
            descriptors: request.names.iter().map(|name| describe(parameters, name)).collect(),
        })?;
        self.get.answer_all(|request| GetParametersResponse {
            values: request.names.iter().map(|name| value(parameters, name)).collect(),
        })?;
        self.get_types.answer_all(|request| GetParameterTypesResponse {
            types: request.names.iter().map(|name| value(parameters, name).r#type).collect(),
        })?;
        self.list.answer_all(|request| ListParametersResponse { result: list(&parameters.names(), &request) })?;
        self.set.answer_all(|request| SetParametersResponse {
            results: request.parameters.into_iter().map(|parameter| set(parameters, vec![parameter])).collect(),
        })?;
        self.set_atomically
            .answer_all(|request| SetParametersAtomicallyResponse { result: set(parameters, request.parameters) })?;
        self.describe_type.answer_all(|request| type_description::answer(&request))?;
        self.tell_changes()
    }

    fn tell_changes(&self) -> Result<(), RosError> {
        let changed_parameters = self.parameters.take_changes();
        if changed_parameters.is_empty() {
            return Ok(());
        }
        self.events.publish(&ParameterEvent {
            stamp: self.clock.stamp(),
            node: self.node.clone(),
            changed_parameters,
            ..Default::default()
        })
    }
}

fn describe(parameters: &Parameters, name: &str) -> ParameterDescriptor {
    parameters.describe(name).unwrap_or_else(|| ParameterDescriptor {
        name: name.to_owned(),
        r#type: ParameterType::PARAMETER_NOT_SET,
        ..Default::default()
    })
}

fn value(parameters: &Parameters, name: &str) -> ParameterValue {
    parameters.value(name).map(|value| value.to_msg()).unwrap_or_default()
}

fn set(parameters: &Parameters, wanted: Vec<Parameter>) -> SetParametersResult {
    let values: Result<Vec<_>, RosError> = wanted
        .into_iter()
        .map(|parameter| match Value::from_msg(&parameter.value) {
            Ok(value) => Ok((parameter.name, value)),
            Err(reason) => Err(RosError::Parameter { name: parameter.name, reason }),
        })
        .collect();
    match values.and_then(|values| parameters.set_all(values)) {
        Ok(()) => SetParametersResult { successful: true, reason: String::new() },
        Err(error) => SetParametersResult { successful: false, reason: error.to_string() },
    }
}

/// The names under the prefixes, down to the depth, and the prefixes that they have.
fn list(names: &[String], request: &ListParametersRequest) -> ListParametersResult {
    let depth_of = |name: &str| name.matches('.').count() as u64;
    let unlimited = request.depth == ListParametersRequest::DEPTH_RECURSIVE;
    let wanted = |name: &&String| {
        if request.prefixes.is_empty() {
            return unlimited || depth_of(name) < request.depth;
        }
        request.prefixes.iter().any(|prefix| {
            *name == prefix
                || name
                    .strip_prefix(prefix.as_str())
                    .and_then(|rest| rest.strip_prefix('.'))
                    .is_some_and(|rest| unlimited || depth_of(rest) < request.depth)
        })
    };
    let names: Vec<String> = names.iter().filter(wanted).cloned().collect();
    let mut prefixes: Vec<String> = names.iter().filter_map(|name| Some(name.rsplit_once('.')?.0.to_owned())).collect();
    prefixes.dedup();
    ListParametersResult { names, prefixes }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_are_cut_by_prefix_and_depth() {
        let names = ["pace", "wheels.limit", "wheels.rate.max", "wheelspeed"].map(str::to_owned);
        let ask = |prefixes: &[&str], depth| {
            let prefixes = prefixes.iter().map(|prefix| (*prefix).to_owned()).collect();
            list(&names, &ListParametersRequest { prefixes, depth })
        };
        assert_eq!(ask(&[], 0).names, names);
        assert_eq!(ask(&[], 0).prefixes, ["wheels", "wheels.rate"]);
        assert_eq!(ask(&[], 1).names, ["pace", "wheelspeed"]);
        assert_eq!(ask(&["wheels"], 0).names, ["wheels.limit", "wheels.rate.max"]);
        assert_eq!(ask(&["wheels"], 1).names, ["wheels.limit"]);
        assert_eq!(ask(&["pace"], 1).names, ["pace"]);
        assert!(ask(&["none"], 0).names.is_empty());
    }
}
