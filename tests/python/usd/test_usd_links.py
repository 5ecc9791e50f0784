"""Light linking: the collections lightLink and shadowLink of lights."""

import xml.etree.ElementTree as ElementTree

import lightshaft.usd
import pytest
from stage_kit import Sdf, UsdGeom, UsdLux, camera, new_stage, path_of


@pytest.fixture
def stage(tmp_path):
    made = new_stage(tmp_path)
    camera(made, (0, 5, 0), (0, 0, 0), up=(0, 0, 1))
    for name in ("set/ball", "set/block", "far"):
        UsdGeom.Sphere.Define(made, f"/{name}")
    UsdLux.SphereLight.Define(made, "/key").CreateTreatAsPointAttr(True)
    return made


def scene(stage):
    found = lightshaft.usd.read(path_of(stage))
    assert not found.warnings
    return ElementTree.fromstring(found.main.xml)


def texts(root, name):
    """Returns the values of a parameter by the ids of the objects, or of those around them."""
    found = {}
    for top in root:
        for text in top.iter("string"):
            if text.get("name") == name:
                found[top.get("id")] = text.get("value")
    return found


def light(stage, path="/key"):
    return UsdLux.LightAPI(stage.GetPrimAtPath(path))


def test_a_light_without_collections_has_no_links(stage):
    root = scene(stage)

    assert not any(texts(root, name) for name in ("receivers", "blockers", "link_sets"))


def test_what_a_light_excludes_is_in_its_link_set(stage):
    light(stage).GetLightLinkCollectionAPI().ExcludePath("/set")

    root = scene(stage)

    assert texts(root, "receivers") == {"/key": "-key_receivers"}
    assert texts(root, "link_sets") == {"/set/ball": "key_receivers", "/set/block": "key_receivers"}


def test_what_a_light_includes_is_in_its_link_set(stage):
    links = light(stage).GetShadowLinkCollectionAPI()
    links.CreateIncludeRootAttr(False)
    links.IncludePath("/set")
    links.ExcludePath("/set/block")

    root = scene(stage)

    assert texts(root, "blockers") == {"/key": "key_blockers"}
    assert texts(root, "link_sets") == {"/set/ball": "key_blockers"}


def test_lights_of_equal_collections_share_a_link_set(stage):
    UsdLux.RectLight.Define(stage, "/fill")
    for path in ("/key", "/fill"):
        light(stage, path).GetLightLinkCollectionAPI().ExcludePath("/far")

    root = scene(stage)

    assert len(set(texts(root, "receivers").values())) == 1
    assert set(texts(root, "link_sets")) == {"/far"}


@pytest.mark.parametrize(("include", "expected"), [(True, {}), (False, {"/key": "none"})])
def test_a_collection_of_what_is_not_there(stage, include, expected):
    links = light(stage).GetLightLinkCollectionAPI()
    links.CreateIncludeRootAttr(include)
    links.ExcludePath("/nothing") if include else links.IncludePath("/nothing")

    root = scene(stage)

    assert texts(root, "receivers") == expected
    assert not texts(root, "link_sets")


def test_instances_of_a_prototype_have_links_of_their_own(stage):
    UsdGeom.Sphere.Define(stage, "/class/ball")
    stage.GetPrimAtPath("/class").SetSpecifier(Sdf.SpecifierClass)
    for name in ("a", "b", "c"):
        prim = UsdGeom.Xform.Define(stage, f"/{name}").GetPrim()
        prim.GetReferences().AddInternalReference("/class")
        prim.SetInstanceable(True)
    light(stage).GetLightLinkCollectionAPI().ExcludePath("/b")

    root = scene(stage)

    assert len(texts(root, "link_sets")) == 1


def test_a_light_without_shadows_has_no_blockers(stage):
    UsdLux.ShadowAPI.Apply(stage.GetPrimAtPath("/key")).CreateShadowEnableAttr(False)
    light(stage).GetShadowLinkCollectionAPI().ExcludePath("/far")

    root = scene(stage)

    assert texts(root, "blockers") == {"/key": "none"}


def test_a_membership_expression_is_warned_of(stage):
    links = light(stage).GetLightLinkCollectionAPI()
    links.CreateIncludeRootAttr(False)
    links.CreateMembershipExpressionAttr(Sdf.PathExpression("//ball"))

    found = lightshaft.usd.read(path_of(stage))

    assert "membershipExpression" in "\n".join(found.warnings)
