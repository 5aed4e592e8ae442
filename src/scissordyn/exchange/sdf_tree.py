"""Choose a tree of bodies from the links and joints of a model, and write it in MJCF."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections import defaultdict
from typing import Any, NamedTuple

import numpy as np

from scissordyn.errors import InputError
from scissordyn.exchange.loop_joint import WORLD, Pose, pose
from scissordyn.exchange.xml_element import DEPTH_MAX, EXAMPLE, number_text

Inertial = tuple[Pose, np.ndarray, float, np.ndarray]
"""Pose of a link in the world; mass centre, mass and inertia in the frame of the link."""


class Edge(NamedTuple):
    """Joint between two links of an SDF model."""

    name: str
    shown: str  # Name and line for messages
    type: str  # Type of the joint in SDF
    links: tuple[str, str]  # Child and parent
    pose: Pose  # Pose in the world
    axis: np.ndarray  # Direction of the axis in the world
    attributes: dict[str, str]  # Limits, spring, damping and friction, as in MJCF

    @property
    def order(self) -> int:
        """Rank from 0 (weld) to 4 (ball) for the choice of the tree; joints with the highest ranks close the loops."""
        if self.type == "ball":
            return 4
        return {"fixed": 0, "prismatic": 1}.get(self.type, 2 if self.attributes else 3)


class Tree(NamedTuple):
    """Tree of links, and the joints that are not in it."""

    parents: dict[str, str]  # Parent of each link, parents first; "" for a link that moves freely
    edges: dict[str, Edge]  # Joint of each link with its parent
    loops: list[Edge]


def spanning_tree(links: list[str], edges: list[Edge], first: str) -> Tree:
    """Return a tree that connects all links by the joints of the lowest rank (Kruskal); the other joints close loops."""
    group = {link: {link} for link in (WORLD, *links)}
    beside = defaultdict[str, list[Edge]](list)
    loops = []
    for edge in sorted(edges, key=lambda edge: edge.order):
        child_group, parent_group = (group[link] for link in edge.links)
        if child_group is parent_group:
            loops.append(edge)
            continue
        child_group |= parent_group
        group |= dict.fromkeys(parent_group, child_group)
        for link in edge.links:
            beside[link].append(edge)
    parents: dict[str, str] = {}
    joints: dict[str, Edge] = {}
    for root in (WORLD, first, *links):
        if root in parents or root not in group:
            continue
        parents[root] = ""
        stack = [(root, 1)]
        while stack:
            link, depth = stack.pop()
            if depth > DEPTH_MAX:
                raise InputError(f"a chain of the model has more than {DEPTH_MAX} links", "shorter chains", EXAMPLE)
            for edge in beside[link]:
                (further,) = set(edge.links) - {link}
                if further not in parents:
                    parents[further], joints[further] = link, edge
                    stack.append((further, depth + 1))
    del parents[WORLD]
    return Tree(parents, joints, loops)


def mjcf_of(tree: Tree, bodies: dict[str, Inertial], gravity: tuple[float, ...]) -> str:
    """Return the text of an MJCF model of a tree; `bodies` are the poses and inertias of its links by name."""
    root = ET.Element("mujoco")
    ET.SubElement(root, "compiler", angle="radian")
    ET.SubElement(root, "option", gravity=number_text(*gravity))
    elements = {WORLD: ET.SubElement(root, "worldbody")}
    for link, parent in tree.parents.items():
        here, centre, mass, inertia = bodies[link]
        outer = bodies[parent][0] if parent in bodies else pose()
        inner = outer.inverse().times(here)
        place: dict[str, Any] = {"pos": number_text(*inner.position), "quat": number_text(*inner.quaternion)}
        element = elements[link] = ET.SubElement(elements[parent or WORLD], "body", name=link, **place)
        moments = number_text(*np.diag(inertia), inertia[0, 1], inertia[0, 2], inertia[1, 2])
        ET.SubElement(element, "inertial", pos=number_text(*centre), mass=repr(mass), fullinertia=moments)
        edge = tree.edges.get(link)
        if edge is None:
            ET.SubElement(element, "freejoint")
        elif edge.type != "fixed":
            at = here.inverse().times(edge.pose)
            # a link below its child in the tree moves in the opposite sense
            axis = here.rotation.inv().apply(edge.axis) * (1.0 if edge.links[0] == link else -1.0)
            kind = "slide" if edge.type == "prismatic" else "hinge"
            attributes: dict[str, Any] = {"pos": number_text(*at.position), "axis": number_text(*axis), **edge.attributes}
            ET.SubElement(element, "joint", name=edge.name, type=kind, **attributes)
    return ET.tostring(root, encoding="unicode")
