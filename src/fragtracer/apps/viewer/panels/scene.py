# SPDX-License-Identifier: MIT
"""The scene panel: objects and lights, the selected one, camera, environment and ambient light."""

from dataclasses import replace
from typing import Any

from imgui_bundle import imgui

from fragtracer.apps.viewer import camera as cameras
from fragtracer.apps.viewer.document import KINDS, Part, is_light, materials_of
from fragtracer.apps.viewer.panels import animation, camera, environment, lights, materials, media, objects, widgets
from fragtracer.apps.viewer.session import Session
from fragtracer.apps.viewer.theme import MUTED
from fragtracer.scene import Medium, Mesh, Scene

_LIST_ROWS = 7.5


def draw(session: Session) -> None:
    """Draw the panel; edits go through :meth:`Session.edit`."""
    if widgets.header("Contents"):
        _contents(session)
    if session.selected is not None and widgets.header(
        f"{objects.title(session.document.scene, session.selected)}###s"
    ):
        _selected(session, session.selected)
    if animation.can_move(session) and widgets.header("Animation"):
        animation.edit(session)
    if widgets.header("Camera"):
        session.camera = camera.edit(session.camera)
        session.camera, keep = camera.viewpoints(session.camera, session.home, session.viewpoints)
        if keep:
            session.keep_viewpoint(keep)
    if widgets.header("Environment"):
        _environment(session)
    if widgets.header("Media"):
        _media(session)
    if widgets.header("Ambient light"):
        _ambient(session)


def _contents(session: Session) -> None:
    count = sum(len(getattr(session.document.scene, kind)) for kind in KINDS)
    height = min(_LIST_ROWS, count + 0.5) * imgui.get_text_line_height_with_spacing()
    imgui.push_style_color(imgui.Col_.child_bg, imgui.ImVec4(0, 0, 0, 0.18))
    if imgui.begin_child("contents", imgui.ImVec2(0, height)):
        document, session.selected = objects.choose(session.document, session.selected)
        session.edit(document, "visibility")
    imgui.end_child()
    imgui.pop_style_color()
    if imgui.button("Add light"):
        imgui.open_popup("add light")
    if imgui.begin_popup("add light"):
        for kind, name in lights.NEW.items():
            if imgui.selectable(name.capitalize(), False)[0]:
                add_light(session, kind)
        imgui.end_popup()
    imgui.same_line()
    imgui.begin_disabled(session.selected is None)
    if imgui.button("Remove") and session.selected is not None:
        remove(session, session.selected)
    imgui.end_disabled()


def _selected(session: Session, place: Part) -> None:
    document, around = session.document, cameras.distance(session.camera)
    part: Any = document.part(place)
    imgui.push_id(f"{place}")
    if is_light(part):
        changed = lights.edit(part, around)
        if changed is not part:
            session.edit(document.with_part(place, changed), f"light {place}")
    else:
        changed = objects.edit(part, list(document.scene.materials), around)
        if changed is not part:
            with session.checked():  # a plane cannot have a material that emits
                session.edit(document.with_part(place, changed), f"object {place}")
        name = _material_of(session, place)
        imgui.separator_text(f"Material “{name}”")
        scene = session.document.scene
        others = [n for n, other in scene.materials.items() if n != name and not (other.blend or other.unlit)]
        material = materials.edit(scene.materials[name], isinstance(part, Mesh), list(scene.media), others)
        if material is not scene.materials[name]:
            with session.checked():  # two dielectrics that overlap cannot have the same priority
                session.edit(session.document.with_material(name, material), f"material {name}")
        users = session.users(name)
        if users > 1:
            imgui.text_colored(MUTED, f"shared by {users} objects")
    imgui.pop_id()


def _media(session: Session) -> None:
    scene = session.document.scene
    fog = media.fog(scene.fog, list(scene.media))
    if fog != scene.fog:
        _edit(session, replace(scene, fog=fog), "fog")
    for name, medium in scene.media.items():
        imgui.push_id(f"medium {name}")
        imgui.separator_text(f"Medium “{name}”")
        changed = media.edit(medium)
        if changed is not medium:
            scene = session.document.scene
            _edit(session, replace(scene, media={**scene.media, name: changed}), f"medium {name}")
        imgui.pop_id()
    if imgui.button("Add medium"):
        add_medium(session)


def _environment(session: Session) -> None:
    scene = session.document.scene
    changed = environment.edit(scene.environment, session.environment)
    session.environment = changed or scene.environment or session.environment
    if changed != scene.environment:
        _edit(session, replace(scene, environment=changed), "environment")


def _ambient(session: Session) -> None:
    scene = session.document.scene
    radiance = widgets.color("Radiance", scene.ambient.radiance, hdr=True)
    changed = widgets.edited(scene.ambient, radiance=radiance)
    if changed != scene.ambient:
        _edit(session, replace(scene, ambient=changed), "ambient")


def _material_of(session: Session, place: Part) -> str:
    """The name of the material to edit; of a mesh with several, or of a blend, the chosen one."""
    scene, own = session.document.scene, materials_of(session.document.part(place))
    names = list(dict.fromkeys(blended for name in own for blended in scene.blended(name)))
    if len(names) > 1:
        name = session.material if session.material in names else names[0]
        session.material = widgets.choice("Edit", name, names)
        return session.material
    return names[0]


def add_light(session: Session, kind: str) -> None:
    """Add a light of ``kind``, one of :data:`lights.NEW`, above what the camera looks at, and select it."""
    count = len(getattr(session.document.scene, kind))
    with session.checked():  # what is lit may be so far away that no power suffices
        session.edit(session.document.with_added(kind, lights.new_light(kind, session.camera)), "add light")
        session.history.close()
        session.selected = (kind, count)


def add_medium(session: Session) -> None:
    """Add a medium, for the interior of materials or the fog to name."""
    scene = session.document.scene
    _edit(session, replace(scene, media={**scene.media, media.new_name(list(scene.media)): Medium()}), "add medium")
    session.history.close()


def remove(session: Session, place: Part) -> None:
    """Remove an object or light from the scene."""
    session.edit(session.document.without_part(place), f"remove {place}")
    session.history.close()
    session.selected = None


def _edit(session: Session, scene: Scene, label: str) -> None:
    session.edit(replace(session.document, scene=scene), label)
