"""Messages in the words that users know: the name that is meant, and what to give instead."""

import numpy as np
import pytest

import survey
from survey import api, measures, methods, modules
from survey.request import workflow
from survey.scenes import load


def message(call, *args, **keywords):
    with pytest.raises(survey.BadInput) as caught:
        call(*args, **keywords)
    return str(caught.value)


def a_survey(scene="mathieu", a=None, **more):
    axes = {"a": {"start": 0.0, "stop": 4.0, "num": 5} if a is None else a, "q": 0.1}
    return {"scene": scene, "axes": axes, "output": {"path": "x.nc"}, **more}


@pytest.mark.parametrize("word", ["tol", "tolerance", "accuracy"])
def test_a_tolerance_is_rtol(word):
    assert "did you mean 'rtol'?" in message(
        survey.evaluate, "mathieu", a=1.0, q=0.1, **{word: 1e-8}
    )
    assert "did you mean 'rtol'?" in message(workflow.check, a_survey(solver={word: 1e-8}))
    assert "put rtol under [solver]" in message(workflow.check, a_survey(**{word: 1e-8}))


@pytest.mark.parametrize("word", ["disc", "trace"])
def test_the_trace_is_the_discriminant(word):
    asked = message(survey.evaluate, "mathieu", a=1.0, q=0.1, variables=[word])
    assert "did you mean 'discriminant'?" in asked


def test_a_step_is_a_number_of_values():
    said = message(workflow.check, a_survey(a={"start": 0.0, "stop": 4.0, "step": 0.1}))
    assert said.startswith("unknown key axes.a.step; give num, the number of values")


def test_an_end_outside_its_domain_names_what_may_take_its_place():
    given = {"scene": "satellite", "output": {"path": "x.nc"}}
    k = message(
        workflow.check, given | {"axes": {"k": {"start": 0.0, "stop": 1.0, "num": 5}, "rho": 1.0}}
    )
    assert "end 1, outside its domain; allowed: 0 <= k" in k and k.endswith(
        "you can give one_minus_k or amplitude"
    )
    body = {"k": 0.5, "inertia_ratio": {"start": -1.0, "stop": 1.5, "num": 5}}
    assert message(workflow.check, given | {"axes": body}).endswith(
        "instead of inertia_ratio you can give rho"
    )
    e = {"mu": 0.01, "e": {"start": 0.0, "stop": 1.0, "num": 3}}
    assert message(workflow.check, given | {"scene": "libration_elliptic", "axes": e}).endswith(
        "0 <= e < 1"
    )
    degrees = {"amplitude": {"start": 0.0, "stop": 90.0, "num": 5}, "rho": 1.0}
    turned = message(workflow.check, given | {"axes": degrees})
    assert (
        "allowed: 0 <= amplitude < 1.5708 (rad); if it is in degrees, give amplitude_deg = 90"
        in turned
    )
    assert turned.endswith("instead of amplitude you can give k or one_minus_k")


def test_values_of_a_workflow_that_are_words():
    """A number in quotes, a body among the axes; and how many mistakes there are besides the first."""
    assert (
        message(workflow.check, a_survey(a="1"))
        == "axes.a = '1': it must be a number, without quotes"
    )
    libration = {"scene": "libration", "axes": {"body": "Earth-Moon"}}
    assert message(workflow.check, libration).startswith(
        "axes.body: bodies are named under [options], as in body = '"
    )
    listed = {"scene": "libration", "axes": {"body": {"values": ["Earth-Moon", "Sun-Jupiter"]}}}
    assert message(workflow.check, listed).endswith("several, in Python")
    assert message(workflow.check, {}).endswith("(and 1 more mistake)")


def test_what_is_opened_is_one_file(tmp_path):
    assert message(survey.open, ["a.nc", "b.nc"]).endswith("survey.concat joins several")
    with pytest.raises(
        TypeError, match="give the path of a file that survey model has made, not 3"
    ):
        survey.Model(3)


def test_messages_name_keywords_of_functions_and_names_of_files(tmp_path):
    made = {"period": 6.0, "parameters": "a"}
    assert "even = 'yes': it must be True or False" in message(
        survey.hill, lambda u, p: p[0], even="yes", **made
    )
    odd = survey.hill(lambda u, p: p[0] + np.sin(u), even=True, **made)
    said = message(survey.evaluate, odd, a=1.0)
    assert "; set even = False, or correct z or period" in said and "EVEN" not in said
    assert "structure = 'x'" in message(
        survey.floquet, lambda t, p, out: None, states="x", structure="x", **made
    )
    path = tmp_path / "own.py"
    path.write_text(
        "EVEN = 'yes'\nPERIOD = 6.0\nPARAMETERS = 'a'\n\n\ndef z(u, p):\n    return p[0]\n"
    )
    assert "EVEN = 'yes': it must be True or False" in message(survey.evaluate, str(path), a=1.0)


def test_other_words_mean_names_that_exist():
    """Each is a key of a workflow, a keyword, or a name in some scene."""
    names = {"rtol", "method", "variables", "num", "start", "stop", "spacing", "path"}
    for scene in api.scenes():
        module = load(scene)
        names |= {one.name for one in (*module.PARAMETERS, *module.OUTPUTS)}
    assert set(modules.OTHER_WORDS.values()) <= names


def test_a_scene_describes_its_methods_by_what_they_do_for_it():
    for scene in api.scenes():
        for name, line in api.scene(scene)["methods"].items():
            if name != "auto":
                method, family = measures.method(name), load(scene).FAMILY
                assert len(method.SERVES) == 1 or line.startswith(
                    method.ABOUT[family].removesuffix(".")
                ), (scene, name)
    for name in modules.names(methods):
        method = measures.method(name)
        assert len(method.SERVES) == 1 or set(method.ABOUT) >= set(method.SERVES), name
    danby, hill = (
        api.scene(scene)["methods"]["taylor16"] for scene in ("libration_elliptic", "satellite")
    )
    assert "y'' + z y = 0" in hill and "y''" not in danby and "L4" in danby
