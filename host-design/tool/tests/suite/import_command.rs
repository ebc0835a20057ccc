//! `upright import`: the machine of a URDF becomes a rig file, or the joint that prevents it is named.

use std::path::Path;
use std::process::Command;

use upright_design::rig::Rig;
use upright_test_support::limits::output;
use upright_tool::import::rig_file;

/// A cart and two links that hang, drawn along y. The second link has a tip mass that is fixed to it.
const DOUBLE: &str = r#"<?xml version="1.0"?>
<robot name="double">
  <link name="world"/>
  <link name="rail"/>
  <joint name="rail_on_ground" type="fixed"><parent link="world"/><child link="rail"/><origin rpy="0 0 1.5707963267948966"/></joint>
  <link name="cart"><inertial><mass value="0.6"/><inertia ixx="1" iyy="1" izz="1"/></inertial></link>
  <joint name="slide" type="prismatic">
    <parent link="rail"/><child link="cart"/><axis xyz="1 0 0"/><origin xyz="0 0 1"/>
    <limit lower="-0.4" upper="0.5" effort="12" velocity="2"/><dynamics damping="3" friction="0.5"/>
  </joint>
  <link name="lower">
    <inertial><origin xyz="0 0 -0.1" rpy="0 0 0.3"/><mass value="0.2"/><inertia ixx="2e-3" iyy="2e-3" izz="1e-5"/></inertial>
  </link>
  <joint name="shoulder" type="continuous">
    <parent link="cart"/><child link="lower"/><axis xyz="0 1 0"/><dynamics damping="1e-3" friction="2e-4"/>
  </joint>
  <link name="upper"><inertial><origin xyz="0 0 -0.15"/><mass value="0.1"/><inertia ixx="7e-4" iyy="7.5e-4" izz="0"/></inertial></link>
  <joint name="elbow" type="revolute">
    <parent link="lower"/><child link="upper"/><axis xyz="0 -1 0"/><origin xyz="0 0.02 -0.25"/><limit lower="-3" upper="3"/>
  </joint>
  <link name="tip"><inertial><mass value="0.1"/></inertial></link>
  <joint name="glue" type="fixed"><parent link="upper"/><child link="tip"/><origin xyz="0 0 -0.25"/></joint>
</robot>"#;

#[test]
fn masses_lengths_and_inertias_are_those_of_the_bodies() {
    let text = rig_file(DOUBLE, "double.urdf").unwrap();
    let rig = Rig::from_toml(&text, Path::new("double.toml")).unwrap();
    let chain = rig.chain().unwrap();
    let close = |x: f64, wanted: f64| assert!((x - wanted).abs() < 1e-9, "{x} instead of {wanted}:\n{text}");
    close(chain.cart.mass_kg.unwrap(), 0.6);
    close(chain.cart.friction_n_s_per_m, 3.0);
    assert_eq!(chain.cart.travel_m, [-0.4, 0.5]);
    let [lower, upper] = &chain.links[..] else { panic!("{text}") };
    close(lower.mass_kg, 0.2);
    close(lower.length_m, 0.25);
    close(lower.centre_of_mass_m.unwrap(), 0.1);
    close(lower.inertia_kg_m2.unwrap(), 2e-3);
    close(lower.friction_n_m_s_per_rad, 1e-3);
    // 0.1 kg at 0.15 m and 0.1 kg at 0.25 m, each 0.05 m from their common centre of mass.
    close(upper.mass_kg, 0.2);
    close(upper.centre_of_mass_m.unwrap(), 0.2);
    close(upper.inertia_kg_m2.unwrap(), 7.5e-4 + 0.2 * 0.05 * 0.05);
    close(upper.length_m, 0.4);
    assert_eq!(rig.actuator.force().unwrap().limit_n, Some(12.0));
    assert_eq!(rig.reality.friction.cart_friction_n, 0.5);
    assert_eq!([0, 1].map(|joint| rig.reality.friction.joint_friction_n_m.of_joint(joint)), [2e-4, 0.0]);
    // What a URDF does not have is marked; nothing else is.
    let missing: Vec<&str> = text.lines().filter(|line| line.contains("missing")).collect();
    assert_eq!(missing.len(), 7, "{missing:#?}");
}

#[test]
fn another_machine_is_refused_with_the_name_of_the_joint() {
    for (from, to, words) in [
        ("type=\"prismatic\"", "type=\"continuous\"", "joint \"slide\" is continuous"),
        ("type=\"revolute\"", "type=\"prismatic\"", "joint \"elbow\" is prismatic"),
        (
            "<axis xyz=\"0 -1 0\"/>",
            "<axis xyz=\"1 0 0\"/>",
            "joint \"elbow\": its axis has to be level and at right angles",
        ),
        ("<axis xyz=\"1 0 0\"/>", "<axis xyz=\"1 0 0.1\"/>", "joint \"slide\": its axis has to be level"),
        ("<axis xyz=\"1 0 0\"/>", "<axis xyz=\"0 0 0\"/>", "joint \"slide\": its axis has to be level"),
        ("xyz=\"0 0 -0.1\" rpy", "xyz=\"0.02 0 -0.1\" rpy", "joint \"shoulder\": the centre of mass"),
        ("xyz=\"0 0 -0.1\" rpy", "xyz=\"0 0 0.1\" rpy", "joint \"shoulder\": the centre of mass"),
        (
            "type=\"fixed\"><parent link=\"upper\"/>",
            "type=\"continuous\"><parent link=\"lower\"/>",
            "move on the same link",
        ),
        ("<mass value=\"0.6\"/>", "<mass value=\"0\"/>", "joint \"slide\": its link has no mass"),
        (
            "<mass value=\"0.6\"/>",
            "<mass value=\"heavy\"/>",
            "line 6: value = \"heavy\": numbers wanted here: 1",
        ),
        ("<mass value=\"0.6\"/>", "", "line 6: <inertial> has no <mass>"),
        ("<child link=\"upper\"/>", "<child link=\"uper\"/>", "\"uper\", which is not in the file"),
        ("<parent link=\"world\"/>", "<parent link=\"tip\"/>", "there is no prismatic joint"),
        ("<child link=\"cart\"/>", "<child link=\"lower\"/>", "child of no joint: world, cart;"),
        ("<robot name=\"double\">", "<sdf>", "this is no XML"),
    ] {
        assert!(DOUBLE.contains(from), "{from}");
        let error = rig_file(&DOUBLE.replace(from, to), "x.urdf").unwrap_err().to_string();
        assert!(error.contains(words), "{to}: {error}");
    }
    assert!(rig_file("<sdf/>", "x").unwrap_err().to_string().contains("<sdf>"));
    assert!(
        rig_file("<robot><link name=\"a\"/></robot>", "x")
            .unwrap_err()
            .to_string()
            .contains("prismatic joint")
    );
}

/// An arm that turns about a vertical axis, with a link at its end.
#[test]
fn a_rotary_pendulum_is_told_so() {
    let rotary = |kind: &str| {
        let slide =
            DOUBLE.replace("name=\"slide\" type=\"prismatic\"", &format!("name=\"slide\" type=\"{kind}\""));
        slide.replace("<axis xyz=\"1 0 0\"/>", "<axis xyz=\"0 0 -1\"/>")
    };
    for kind in ["continuous", "revolute"] {
        let error = rig_file(&rotary(kind), "x.urdf").unwrap_err().to_string();
        assert!(error.contains("joint \"slide\" turns about a vertical axis"), "{error}");
        assert!(error.contains("docs/other-machines.md"), "{error}");
    }
    // Negative control: a slide along the vertical is another machine.
    let error = rig_file(&rotary("prismatic"), "x.urdf").unwrap_err().to_string();
    assert!(error.contains("its axis has to be level"), "{error}");
}

#[test]
fn the_command_writes_a_rig_file_that_can_be_designed() {
    let folder = tempfile::tempdir().unwrap();
    let [urdf, rig] = ["double.urdf", "double.toml"].map(|name| folder.path().join(name));
    std::fs::write(&urdf, DOUBLE).unwrap();
    let run = |arguments: &[&str]| output(Command::new(env!("CARGO_BIN_EXE_upright")).args(arguments));
    let output = run(&["import", urdf.to_str().unwrap(), "--out", rig.to_str().unwrap()]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let output = run(&["design", rig.to_str().unwrap(), "--no-write", "--json"]);
    assert!(output.stdout.starts_with(b"{"), "{}", String::from_utf8_lossy(&output.stderr));
    std::fs::write(&urdf, DOUBLE.replace("prismatic", "planar")).unwrap();
    let output = run(&["import", urdf.to_str().unwrap(), "--out", rig.to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(2));
    // A file given instead of a rig file is called by its name.
    let output = run(&["check", urdf.to_str().unwrap()]);
    assert!(String::from_utf8_lossy(&output.stderr).contains("upright import"), "{output:?}");
}
