"""Contacts in MuJoCo end with their model, act on no other, and say what goes wrong."""

import copy
import gc
import pickle
import sys
import weakref

import numpy as np
import pytest

import sphshell_pin as sp
from sphshell_pin.errors import InvalidParameter, NotPicklable, SphshellError

mujoco = pytest.importorskip("mujoco")

from sphshell_pin.adapters.mujoco import attach  # noqa: E402
from tests.adapters.mujoco_models import SOFT, model_of, on_slab, plate, slab  # noqa: E402
from tests.programs import python  # noqa: E402


def test_contacts_end_with_their_model_and_touch_no_stranger():
    """A new model may have the address of a deleted one, and another size."""
    addresses, alive = set(), []
    for k in range(30):
        model = mujoco.MjModel.from_xml_string(slab(3))
        addresses.add(model._address)
        contacts = on_slab(model, "ball0", "ball1", "ball2")
        alive.append(weakref.ref(contacts))
        del model, contacts
        other, data = model_of(slab(1 + k % 3))
        mujoco.mj_forward(other, data)
        assert not np.any(data.qfrc_passive)
        assert data.ncon == 1 + k % 3
        addresses.add(other._address)
    gc.collect()
    assert len(addresses) < 60
    assert not any(one() for one in alive)


def test_a_copy_of_a_model_has_its_contacts_while_they_last(monkeypatch):
    model = mujoco.MjModel.from_xml_string(slab(2))
    flags = model.opt.enableflags
    contacts = on_slab(model, "ball0")
    other = copy.deepcopy(model)
    data = mujoco.MjData(other)
    contacts.step(data)
    assert len(contacts.contacts(data).depth) == 1
    second = on_slab(other, "ball1")
    for one, pushed in ((model, [True, False]), (other, [True, True])):
        data = mujoco.MjData(one)
        mujoco.mj_forward(one, data)
        assert [bool(force) for force in data.qfrc_passive[[2, 8]]] == pushed
        assert data.ncon == 2 - sum(pushed)
    for change in (copy.copy, copy.deepcopy, pickle.dumps):
        with pytest.raises(NotPicklable, match="a copy of the model has them"):
            change(contacts)
    # Flags that were overwritten do not end them.
    for overwritten in (flags | 1 << 30, flags):
        model.opt.enableflags = overwritten
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        assert data.qfrc_passive[2] > 0
    with pytest.raises(InvalidParameter, match="the spheres were attached in, or of a copy of it"):
        second.contacts(data)
    third = copy.deepcopy(other)
    told = []
    monkeypatch.setattr(sys, "unraisablehook", lambda fault: told.append(str(fault.exc_value)))
    for one in (contacts, second):
        one.detach()
    assert model.opt.enableflags == flags
    data = mujoco.MjData(third)
    mujoco.mj_forward(third, data)
    mujoco.mj_forward(third, data)
    assert not np.any(data.qfrc_passive)
    assert len(told) == 1
    assert "a copy of a MuJoCo model moves without contacts" in told[0]


def test_data_of_other_models_are_refused_before_they_are_touched():
    big = mujoco.MjModel.from_xml_string(slab(5))
    contacts = on_slab(big, *(f"ball{k}" for k in range(5)), log=True)
    small, data = model_of(slab(1))
    mujoco.mj_forward(small, data)
    for method in (contacts.apply, contacts.contacts, contacts.log, contacts.step):
        for wrong in (data, None, big):
            with pytest.raises(InvalidParameter, match="data"):
                method(wrong)
    assert not np.any(data.qfrc_passive)


def test_any_number_of_spheres_and_none_twice():
    spheres = "".join(
        f'<geom name="s{k}" type="sphere" size=".002" pos="{0.003 * k} 0 0" mass=".01"/>'
        for k in range(40)
    )
    hand = f'<body pos="0 0 .0019"><freejoint/>{spheres}</body></worldbody>'
    model, data = model_of(slab(0).replace("</worldbody>", hand))
    contacts = on_slab(model, *(f"s{k}" for k in range(40)))
    with pytest.raises(InvalidParameter, match="'s3' must not touch the same shell already"):
        on_slab(model, "s3")
    mujoco.mj_forward(model, data)
    assert len(contacts.contacts(data).depth) == 34  # those above the plate
    assert data.ncon == 0


@pytest.mark.parametrize(
    ("slot", "said"), [("passive", "do not act"), ("contactfilter", "acts beside them")]
)
def test_a_callback_that_was_replaced_is_noticed(slot, said):
    model, data = model_of(slab(1))
    contacts = on_slab(model, "ball0")
    try:
        for other in (None, lambda *_: 0):
            getattr(mujoco, f"set_mjcb_{slot}")(other)
            for ask in (contacts.check, lambda: contacts.step(data)):
                with pytest.raises(SphshellError, match=said):
                    ask()
    finally:
        getattr(mujoco, f"set_mjcb_{slot}")(None)
    contacts.detach()
    contacts.check()
    with on_slab(model, "ball0") as again:
        again.step(data)


@pytest.mark.parametrize("fault", ["raises", "nan", "state"])
def test_a_fault_in_a_step_is_reported_at_once_and_by_check(fault, monkeypatch):
    told = []
    monkeypatch.setattr(sys, "unraisablehook", lambda fault: told.append(str(fault.exc_value)))
    attached = False

    def law(depth, rate, p):
        if attached and fault == "raises":
            raise RuntimeError("mine")
        return np.nan if attached and fault == "nan" else 1e5 * max(depth, 0.0) ** 1.5

    model, data = model_of(slab(1))
    contacts = attach(model, plate(0.1), ["ball0"], body="part", law=sp.FunctionLaw(law))
    attached = True
    said = {"raises": "mine", "nan": "is nan at depth", "state": "not finite"}[fault]
    for _ in range(2):
        if fault == "state":
            data.qpos[0] = np.nan
        mujoco.mj_forward(model, data)
        mujoco.mj_forward(model, data)
        assert said in told.pop()
        assert not told
        with pytest.raises(SphshellError, match=said):
            contacts.check()
    contacts.check()


# Programs of their own, as they crashed or hung.
REFUSED = """
import mujoco
from tests.adapters.mujoco_models import slab, on_slab
from sphshell_pin.errors import InvalidParameter
pair = '<contact><pair geom1="ball0" geom2="slab"/></contact></mujoco>'
model = mujoco.MjModel.from_xml_string(slab(2).replace("</mujoco>", pair))
try:
    on_slab(model, "ball0")
except InvalidParameter:
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert data.ncon == 2 and mujoco.get_mjcb_passive() is None
    print("done")
"""
AT_ONCE = """
import mujoco, threading
from concurrent.futures import ThreadPoolExecutor
import sphshell_pin as sp
from tests.adapters.mujoco_models import attach, model_of, plate, slab
law = sp.FunctionLaw(lambda depth, rate, p: 1e5 * max(depth, 0.0))
model, data = model_of(slab(1))
contacts = attach(model, plate(0.1), ["ball0"], body="part", law=law, log=True)
def work():
    for _ in range(30):
        one = threading.Thread(target=lambda: mujoco.mj_step(model, mujoco.MjData(model)))
        one.start()
        one.join()
with ThreadPoolExecutor(6) as pool:
    works = [pool.submit(work) for _ in range(6)]
    while not all(one.done() for one in works):
        contacts.check()
        contacts.log(data)
print("done")
"""

# A mark may be given once: a copy outlives the contacts of its model.
MARKS = """
import copy, mujoco, sys
import numpy as np
from tests.adapters.mujoco_models import on_slab, slab
told = []
sys.unraisablehook = lambda fault: told.append(str(fault.exc_value))
def force(model):
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return bool(np.any(data.qfrc_passive))
old, new = (mujoco.MjModel.from_xml_string(slab(1)) for _ in range(2))
contacts = on_slab(old, "ball0")
copied = copy.deepcopy(old)
assert force(copied) and not told
contacts.detach()
for k in range(33000):
    contacts._core.attach(new._address)
    assert force(new) and not force(copied) if k % 1000 == 0 or k > 32760 else True
    contacts._core.detach()
assert len(told) == 1
contacts._core.attach(new._address)
assert force(new) and not force(copy.deepcopy(new))
assert "more than 32766 models" in told[1]
print("done")
"""


@pytest.mark.parametrize("program", [REFUSED, AT_ONCE, MARKS], ids=["refused", "at once", "marks"])
def test_programs_that_crashed_hung_or_pushed_strangers(program):
    done = python(program)
    assert done.stdout == "done\n", done.stderr


def test_a_log_is_of_its_data_alone_and_goes_on_with_them():
    """Other data may have the address of deleted ones, or their contents."""
    model, data = model_of(slab(1))
    contacts = on_slab(model, "ball0", log=True)
    other = attach(model, plate(0.1), ["ball0"], law=SOFT, log=True)
    for _ in range(3):
        mujoco.mj_step(model, data)
    saved = copy.copy(data)
    assert [len(one.log(data).t) for one in (contacts, other)] == [3, 3]
    assert len(contacts.log(saved).t) == 0
    addresses = set()
    for k in range(50):
        new = copy.copy(saved) if k % 2 else mujoco.MjData(model)
        new.time = 1.0 + k
        addresses.add(new._address)
        assert len(contacts.log(new).t) == 0
        for _ in range(2):
            mujoco.mj_step(model, new)
        assert contacts.log(new).t == pytest.approx([1.0 + k, 1.0 + k + 5e-5])
        del new
    assert len(addresses) < 50
