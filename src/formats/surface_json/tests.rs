use super::*;

fn reads(text: &str) -> Result<ReadSurface, Vec<Fault>> {
    read(text.as_bytes(), &ReadOptions::default())
}

#[test]
fn placeholder_document_reads() {
    let text = r#"{"units":"in","degree_u":1,"degree_v":1,"knots_u":[0,1],"knots_v":[0,0,1,1],
        "control_points":[[[0,0,0],[0,1,0]],[[1,0,0],[1,1,0]]]}"#;
    let read = reads(text).unwrap();
    assert_eq!(read.trimmed.surface.control()[3].to_array(), [25.4, 25.4, 0.0]);
    assert_eq!(read.inferred.len(), 1);
}
