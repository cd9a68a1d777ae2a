//! `~/get_type_description`: what the types are that a node uses, for those who have no files of them.

use swath_msgs::Interface;
use swath_msgs::type_description_interfaces::{
    GetTypeDescriptionRequest, GetTypeDescriptionResponse, TypeDescription, TypeSource,
};

/// What a bag's text has before each type that the first is made of.
const RULE: &str = "================================================================================\n";

/// The answer to a question for a type.
pub(crate) fn answer(request: &GetTypeDescriptionRequest) -> GetTypeDescriptionResponse {
    described(request).unwrap_or_else(|failure_reason| GetTypeDescriptionResponse {
        failure_reason,
        ..GetTypeDescriptionResponse::default()
    })
}

fn described(request: &GetTypeDescriptionRequest) -> Result<GetTypeDescriptionResponse, String> {
    let (name, hash) = (&request.type_name, &request.type_hash);
    let known = Interface::find(name).ok_or_else(|| format!("{name} is no message that this node knows"))?;
    if !hash.is_empty() && hash != known.type_hash {
        return Err(format!("{name} has the hash {}, not {hash}", known.type_hash));
    }
    let type_description: TypeDescription =
        serde_json::from_str(known.description).map_err(|error| error.to_string())?;
    let referenced = type_description.referenced_type_descriptions.iter().map(|referenced| &referenced.type_name);
    let wanted = std::iter::once(name).chain(referenced).filter(|_| request.include_type_sources);
    let type_sources = wanted.filter_map(|name| source(name)).collect::<Vec<_>>();
    Ok(GetTypeDescriptionResponse { successful: true, type_description, type_sources, ..Default::default() })
}

/// The text of one type.
fn source(type_name: &str) -> Option<TypeSource> {
    // A bag's text goes on with those of the types that it is made of.
    let text = Interface::find(type_name)?.schema.split(RULE).next()?;
    Some(TypeSource { type_name: type_name.to_owned(), encoding: "msg".to_owned(), raw_file_contents: text.to_owned() })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ask(type_name: &str, type_hash: &str) -> GetTypeDescriptionResponse {
        answer(&GetTypeDescriptionRequest {
            type_name: type_name.to_owned(),
            type_hash: type_hash.to_owned(),
            include_type_sources: true,
        })
    }

    #[test]
    fn every_message_is_described_with_what_it_is_made_of() {
        for known in Interface::all() {
            let told = ask(known.type_name, known.type_hash);
            assert!(told.successful, "{}: {}", known.type_name, told.failure_reason);
            let described = &told.type_description;
            assert_eq!(described.type_description.type_name, known.type_name);
            assert_eq!(told.type_sources.len(), 1 + described.referenced_type_descriptions.len());
        }
        let told = ask("std_msgs/msg/Header", "");
        let fields = &told.type_description.type_description.fields;
        let told_fields: Vec<_> =
            fields.iter().map(|field| (&*field.name, field.r#type.type_id, &*field.r#type.nested_type_name)).collect();
        assert_eq!(told_fields, [("stamp", 1, "builtin_interfaces/msg/Time"), ("frame_id", 17, "")]);
        assert!(told.type_sources[0].raw_file_contents.ends_with("string frame_id\n"));
        assert!(told.type_sources[1].raw_file_contents.contains("int32 sec"));
    }

    #[test]
    fn other_types_and_hashes_are_refused() {
        assert_eq!(
            ask("std_msgs/msg/Nothing", "").failure_reason,
            "std_msgs/msg/Nothing is no message that this node knows"
        );
        let told = ask("std_msgs/msg/Header", "RIHS01_0");
        assert!(!told.successful && told.failure_reason.ends_with(", not RIHS01_0"), "{}", told.failure_reason);
    }
}
