//! The scene: which meshes stand where. Nodes are walked as a tree, each once, no deeper than [`MAX_DEPTH`].

use glam::{DAffine3, DMat3, DMat4, DQuat, DVec3};

use super::Faults;
use super::document::{Document, Node, whole};
use super::limits::MAX_DEPTH;

/// A mesh where a node puts it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Instance {
    /// The mesh.
    pub(super) mesh: usize,
    /// The node; `None` for a file without nodes.
    pub(super) node: Option<usize>,
    /// From the mesh's coordinates to the scene's.
    pub(super) transform: DAffine3,
}

/// A matrix whose last row differs from 0, 0, 0, 1 by more than this is no affine map; less is rounding of the exporter.
const AFFINE: f64 = 1e-6;

/// All instances, in the order of a walk that takes children in their order; and what had to be supposed.
pub(super) fn instances(document: &Document, faults: &mut Faults, inferred: &mut Vec<String>) -> Vec<Instance> {
    if document.nodes.is_empty() {
        if !document.meshes.is_empty() {
            inferred.push("the file has no nodes: every mesh is taken once, where it is".to_owned());
        }
        return (0..document.meshes.len())
            .map(|mesh| Instance { mesh, node: None, transform: DAffine3::IDENTITY })
            .collect();
    }
    let is_child = parents(document, faults);
    let mut found = Vec::new();
    let mut seen = vec![false; document.nodes.len()];
    let mut open: Vec<(usize, DAffine3, usize)> =
        roots(document, &is_child, faults, inferred).into_iter().rev().map(|n| (n, DAffine3::IDENTITY, 1)).collect();
    while let Some((index, above, depth)) = open.pop() {
        if std::mem::replace(&mut seen[index], true) {
            faults.add(
                &format!("/nodes/{index}"),
                "this node comes twice on the way down the scene: nodes go in a circle",
            );
            continue;
        }
        if depth > MAX_DEPTH {
            faults.add(&format!("/nodes/{index}"), format!("nodes are nested deeper than {MAX_DEPTH}"));
            continue;
        }
        let node = &document.nodes[index];
        let Some(local) = local(node, index, faults) else { continue };
        let transform = above * local;
        if !transform.is_finite() {
            faults.add(&format!("/nodes/{index}"), "its transform, with those above it, is beyond all numbers");
            continue;
        }
        if let Some(mesh) = node.mesh {
            match whole(mesh).filter(|mesh| *mesh < document.meshes.len() as u64) {
                Some(mesh) => found.push(Instance { mesh: mesh as usize, node: Some(index), transform }),
                None => faults.add(
                    &format!("/nodes/{index}/mesh"),
                    format!("there is no mesh {mesh} among the {}", document.meshes.len()),
                ),
            }
        }
        open.extend(children(document, node).rev().map(|child| (child, transform, depth + 1)));
    }
    found
}

/// The children of a node that exist.
fn children<'a>(document: &'a Document, node: &'a Node) -> impl DoubleEndedIterator<Item = usize> + 'a {
    let exists = |child: &f64| whole(*child).filter(|c| *c < document.nodes.len() as u64).map(|c| c as usize);
    node.children.iter().filter_map(exists)
}

/// For each node whether it is a child. Children that do not exist, and nodes with two parents, are noted.
fn parents(document: &Document, faults: &mut Faults) -> Vec<bool> {
    let mut is_child = vec![false; document.nodes.len()];
    for (index, node) in document.nodes.iter().enumerate() {
        for (k, child) in node.children.iter().enumerate() {
            let pointer = format!("/nodes/{index}/children/{k}");
            match whole(*child).and_then(|child| is_child.get_mut(usize::try_from(child).ok()?)) {
                None => faults.add(&pointer, format!("there is no node {child} among the {}", document.nodes.len())),
                Some(is_child) if *is_child => {
                    faults.add(&pointer, format!("node {child} hangs under two nodes; a scene is a tree"));
                }
                Some(is_child) => *is_child = true,
            }
        }
    }
    is_child
}

/// Where the walk begins: the nodes of the scene to be shown, else every node that is no child.
fn roots(document: &Document, is_child: &[bool], faults: &mut Faults, inferred: &mut Vec<String>) -> Vec<usize> {
    let scene = match (document.scene, document.scenes.as_slice()) {
        (Some(scene), scenes) => {
            let found = whole(scene).and_then(|scene| scenes.get(usize::try_from(scene).ok()?).map(|s| (scene, s)));
            if found.is_none() {
                faults.add("/scene", format!("there is no scene {scene} among the {}", scenes.len()));
                return Vec::new();
            }
            found
        }
        (None, [only]) => Some((0, only)),
        (None, _) => None,
    };
    let Some((number, scene)) = scene else {
        inferred.push("the file names no scene: all nodes are taken".to_owned());
        let roots: Vec<usize> = (0..is_child.len()).filter(|&n| !is_child[n]).collect();
        if roots.is_empty() {
            faults.add("/nodes", "every node hangs under another one: nodes go in a circle");
        }
        return roots;
    };
    let mut roots = Vec::with_capacity(scene.nodes.len());
    for (k, node) in scene.nodes.iter().enumerate() {
        match whole(*node).filter(|node| *node < document.nodes.len() as u64) {
            Some(node) => roots.push(node as usize),
            None => faults.add(
                &format!("/scenes/{number}/nodes/{k}"),
                format!("there is no node {node} among the {}", document.nodes.len()),
            ),
        }
    }
    roots
}

/// The transform of a node alone.
fn local(node: &Node, index: usize, faults: &mut Faults) -> Option<DAffine3> {
    if let Some(m) = node.matrix {
        let affine = [m[3], m[7], m[11], m[15] - 1.0].iter().all(|x| x.abs() <= AFFINE);
        if !affine {
            faults
                .add(&format!("/nodes/{index}/matrix"), "its last row is not 0, 0, 0, 1: it is no placement in space");
            return None;
        }
        return Some(DAffine3::from_mat4(DMat4::from_cols_array(&m)));
    }
    let rotation = match node.rotation {
        None => DQuat::IDENTITY,
        Some(q) => {
            let length = q.iter().map(|x| x * x).sum::<f64>().sqrt();
            if !(length > 0.0 && length.is_finite()) {
                faults
                    .add(&format!("/nodes/{index}/rotation"), "a rotation is a quaternion of length 1; this has none");
                return None;
            }
            DQuat::from_array(q.map(|x| x / length))
        }
    };
    let scale = DMat3::from_diagonal(node.scale.map_or(DVec3::ONE, DVec3::from_array));
    let translation = node.translation.map_or(DVec3::ZERO, DVec3::from_array);
    Some(DAffine3::from_mat3_translation(DMat3::from_quat(rotation) * scale, translation))
}
