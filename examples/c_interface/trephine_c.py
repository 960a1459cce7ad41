# SPDX-License-Identifier: MIT
"""trephine's C interface for Python, with ctypes alone. Units and frames: see trephine_c.h.

Run as a program, it drills a block of bone:  python3 trephine_c.py path/to/libtrephine_c.so
"""

import array
import ctypes as c
import math
import os

INT16, FLOAT32 = 0, 1
LINE, SURFACE, COUPLED = 0, 1, 2
MILL_NOTHING, MILL_GEOMETRIC, MILL_RATE_LIMITED, MILL_BY_LAW = 0, 1, 2, 3
STATUS_OK, STATUS_BAD_INPUT = 0, 4
GUARD_OFF, GUARD_WARN, GUARD_PUSH = 0, 1, 2
VETO_FREE, VETO_WATCH, VETO_PROTECT, VETO_KEEP_IN = 0, 1, 2, 3
HALOED = 10


def rpm(turns):
    """Turns a minute as radians a second."""
    return turns * 2 * math.pi / 60


class Pose(c.Structure):
    _fields_ = [("position", c.c_double * 3), ("rotation", c.c_double * 4)]

    def __init__(self, position=(0, 0, 0), rotation=(0, 0, 0, 1)):
        super().__init__((c.c_double * 3)(*position), (c.c_double * 4)(*rotation))


class GridOptions(c.Structure):
    _fields_ = [("struct_size", c.c_uint32), ("density_type", c.c_int32), ("size", c.c_int32 * 3),
                ("keep_original", c.c_int32), ("spacing", c.c_double * 3), ("X_WG", Pose), ("outside", c.c_double)]


class Tool(c.Structure):
    _fields_ = [("tip_radius", c.c_double), ("shaft_radius", c.c_double), ("shaft_length", c.c_double)]


class SceneOptions(c.Structure):
    _fields_ = [("struct_size", c.c_uint32), ("algorithm", c.c_int32), ("isovalue", c.c_double), ("tool", Tool),
                ("stiffness", c.c_double), ("sphere_vertices", c.c_int32), ("slices", c.c_int32),
                ("per_slice", c.c_int32), ("shaft_vertices", c.c_int32), ("static_friction", c.c_double),
                ("kinetic_friction", c.c_double), ("damping", c.c_double), ("angular_damping", c.c_double),
                ("milling", c.c_int32), ("reserved", c.c_int32), ("milling_rate", c.c_double),
                ("milling_force", c.c_double), ("force_limit", c.c_double), ("torque_limit", c.c_double),
                ("rotational_stiffness", c.c_double), ("tool_name", c.c_char_p), ("spindle_speed", c.c_double),
                ("force_scale", c.c_double), ("stall_torque", c.c_double), ("soft_density", c.c_double),
                ("cortical_density", c.c_double)]


class TickResult(c.Structure):
    _fields_ = [("struct_size", c.c_uint32), ("status", c.c_int32), ("force", c.c_double * 3),
                ("torque", c.c_double * 3), ("depth", c.c_double), ("removed_mm3", c.c_double),
                ("removed_total_mm3", c.c_double), ("X_WV", Pose), ("contacts", c.c_int32), ("tip", c.c_uint8),
                ("shaft", c.c_uint8), ("reserved", c.c_uint8 * 2), ("nearest", c.c_int32), ("warns", c.c_int32),
                ("distance", c.c_double), ("push_force", c.c_double * 3), ("push_torque", c.c_double * 3),
                ("refused_mm3", c.c_double), ("taken_mm3", c.c_double), ("thrust", c.c_double),
                ("spindle_torque", c.c_double), ("spindle_speed", c.c_double), ("feed", c.c_double)]


class LabelsOptions(c.Structure):
    _fields_ = [("struct_size", c.c_uint32), ("size", c.c_int32 * 3), ("spacing", c.c_double * 3), ("X_GS", Pose),
                ("reach", c.c_double), ("threads", c.c_int32), ("raw", c.c_int32)]


class StructureOptions(c.Structure):
    _fields_ = [("struct_size", c.c_uint32), ("guard", c.c_int32), ("margin", c.c_double), ("stiffness", c.c_double),
                ("greatest_force", c.c_double), ("damping", c.c_double), ("veto", c.c_int32), ("reserved", c.c_int32),
                ("veto_margin", c.c_double)]


class GuardOptions(c.Structure):
    _fields_ = [("struct_size", c.c_uint32), ("push", c.c_int32), ("ramp_time", c.c_double), ("smoothing", c.c_double),
                ("linear_budget", c.c_double), ("angular_budget", c.c_double)]


class StructureTotals(c.Structure):
    _fields_ = [("struct_size", c.c_uint32), ("breaches", c.c_int32), ("refused_mm3", c.c_double),
                ("taken_mm3", c.c_double)]


class Error(Exception):
    def __init__(self, code, message):
        super().__init__(message)
        self.code = code


class Library:
    """The loaded library. Its functions are called by their names without "trephine_" and raise Error."""

    _arguments = {
        "grid_options_init": [c.POINTER(GridOptions), c.c_size_t],
        "grid_create": [c.POINTER(GridOptions), c.c_void_p, c.c_size_t, c.POINTER(c.c_void_p)],
        "grid_set_pose": [c.c_void_p, c.POINTER(Pose)],
        "grid_restore": [c.c_void_p, c.c_size_t, c.POINTER(c.c_size_t)],
        "grid_copy": [c.c_void_p, c.c_void_p, c.c_size_t],
        "scene_options_init": [c.POINTER(SceneOptions), c.c_size_t],
        "scene_create": [c.c_void_p, c.POINTER(SceneOptions), c.POINTER(c.c_void_p)],
        "tick_result_init": [c.POINTER(TickResult), c.c_size_t],
        "scene_tick": [c.c_void_p, c.POINTER(Pose), c.c_int32, c.c_double, c.POINTER(TickResult)],
        "scene_set_tool": [c.c_void_p, c.c_char_p],
        "scene_reset": [c.c_void_p],
        "labels_options_init": [c.POINTER(LabelsOptions), c.c_size_t],
        "structures_create": [c.POINTER(LabelsOptions), c.c_void_p, c.c_size_t, c.POINTER(c.c_void_p)],
        "structures_count": [c.c_void_p, c.POINTER(c.c_int32)],
        "structure_options_init": [c.POINTER(StructureOptions), c.c_size_t],
        "structures_set": [c.c_void_p, c.c_int32, c.POINTER(StructureOptions)],
        "structures_set_name": [c.c_void_p, c.c_int32, c.c_char_p],
        "structures_name": [c.c_void_p, c.c_int32, c.POINTER(c.c_char_p)],
        "guard_options_init": [c.POINTER(GuardOptions), c.c_size_t],
        "structures_set_guard": [c.c_void_p, c.POINTER(GuardOptions)],
        "protection_create": [c.c_void_p, c.c_void_p, c.POINTER(c.c_void_p)],
        "scene_exchange": [c.c_void_p, c.c_void_p],
        "structure_totals_init": [c.POINTER(StructureTotals), c.c_size_t],
        "scene_structure_totals": [c.c_void_p, c.c_int32, c.POINTER(StructureTotals)],
        "protection_structure_totals": [c.c_void_p, c.c_int32, c.POINTER(StructureTotals)],
        "scene_set_structures": [c.c_void_p, c.c_void_p],
        "scene_set_push": [c.c_void_p, c.c_int32],
        "reader_create": [c.c_void_p, c.POINTER(c.c_void_p)],
        "reader_bricks": [c.c_void_p, c.POINTER(c.c_int32)],
        "reader_changed": [c.c_void_p, c.POINTER(c.c_int32), c.c_size_t, c.POINTER(c.c_size_t)],
        "reader_copy": [c.c_void_p, c.c_int32, c.c_void_p, c.c_size_t],
    }

    def __init__(self, path):
        # Without a slash the system would look among its own libraries, not here.
        self._dll = c.CDLL(os.path.abspath(path) if os.path.exists(path) else path)
        if not hasattr(self._dll, "trephine_last_error"):
            raise OSError(f"{path}: a library, but not trephine's C interface")
        self._dll.trephine_last_error.restype = c.c_char_p
        self.version = self._dll.trephine_version()
        for name, arguments in self._arguments.items():
            function = getattr(self._dll, "trephine_" + name)
            function.argtypes = arguments
            setattr(self, name, self._raising(function))
        for handle in ("grid", "scene", "reader", "structures", "protection"):
            function = getattr(self._dll, f"trephine_{handle}_destroy")
            function.argtypes = [c.c_void_p]
            function.restype = None
            setattr(self, handle + "_destroy", function)

    def _raising(self, function):
        def call(*arguments):
            code = function(*arguments)
            if code != 0:
                raise Error(code, self._dll.trephine_last_error().decode())

        return call

    def options(self, kind):
        """A struct with its defaults: one of the classes of options, TickResult or StructureTotals."""
        init = {GridOptions: self.grid_options_init, SceneOptions: self.scene_options_init,
                TickResult: self.tick_result_init, LabelsOptions: self.labels_options_init,
                StructureOptions: self.structure_options_init, GuardOptions: self.guard_options_init,
                StructureTotals: self.structure_totals_init}[kind]
        made = kind()
        init(c.byref(made), c.sizeof(made))
        return made

    def filled(self, kind, values):
        """The same with some fields set, by their names."""
        made = self.options(kind)
        for name, value in values.items():
            if name not in dict(kind._fields_):
                raise TypeError(f"{kind.__name__} has no {name}")
            setattr(made, name, value.encode() if isinstance(value, str) else value)
        return made


class Grid:
    """The bone. `voxels` is anything that array.array or numpy give as a contiguous buffer of the density type."""

    def __init__(self, library, size, spacing, voxels, density_type=INT16, X_WG=None):
        self.library = library
        self.handle = c.c_void_p()
        o = library.options(GridOptions)
        o.density_type = density_type
        o.size[:] = size
        o.spacing[:] = spacing
        if X_WG is not None:
            o.X_WG = X_WG
        flat = memoryview(voxels).cast("B")
        buffer = (c.c_char * len(flat)).from_buffer_copy(flat)
        library.grid_create(c.byref(o), buffer, len(flat), c.byref(self.handle))

    def restore(self):
        self.library.grid_restore(self.handle, 2**31, None)

    def __del__(self):
        self.library.grid_destroy(self.handle)


class Scene:
    """One tool in one bone; keyword arguments are the fields of SceneOptions. tool_name, as "match-head-3", takes the
    place of tool in a scene of the coupled tool. With milling=MILL_BY_LAW results have the true forces of cutting."""

    def __init__(self, grid, **options):
        self.library = grid.library
        self.handle = c.c_void_p()
        self.options = self.library.filled(SceneOptions, options)
        self.result = self.library.options(TickResult)
        self.library.scene_create(grid.handle, c.byref(self.options), c.byref(self.handle))

    def tick(self, X_WT, spindle_on, dt):
        """The result is the same object each time."""
        self.library.scene_tick(self.handle, c.byref(X_WT), int(spindle_on), dt, c.byref(self.result))
        return self.result

    def set_tool(self, name):
        """Another tool between ticks; the scene goes on as a new one with it."""
        self.library.scene_set_tool(self.handle, name.encode())

    def set_structures(self, structures):
        """Guards Structures as they are set, and keeps cuts from them; None takes guard and vetoes out."""
        self.library.scene_set_structures(self.handle, structures.handle if structures else None)

    def exchange(self, protection):
        """Puts a Protection in, which then holds guard and vetoes before; between ticks."""
        self.library.scene_exchange(self.handle, protection.handle)

    def totals(self, structure):
        """StructureTotals of one structure since it came into the scene; between ticks."""
        made = self.library.options(StructureTotals)
        self.library.scene_structure_totals(self.handle, structure, c.byref(made))
        return made

    def set_push(self, on):
        """Switches the guard's push; distances and vetoes stay."""
        self.library.scene_set_push(self.handle, int(on))

    def __del__(self):
        self.library.scene_destroy(self.handle)


class Structures:
    """Distances to the structures of a segmentation: a byte a voxel, x fastest, 0 for none and s + 1 for structure s."""

    def __init__(self, library, size, spacing, labels, X_GS=None, reach=None, threads=0, raw=False):
        self.library = library
        self.handle = c.c_void_p()
        o = library.options(LabelsOptions)
        o.size[:] = size
        o.spacing[:] = spacing
        o.threads = threads
        o.raw = int(raw)
        if X_GS is not None:
            o.X_GS = X_GS
        if reach is not None:
            o.reach = reach
        flat = memoryview(labels).cast("B")
        buffer = (c.c_char * len(flat)).from_buffer_copy(flat)
        library.structures_create(c.byref(o), buffer, len(flat), c.byref(self.handle))
        count = c.c_int32()
        library.structures_count(self.handle, c.byref(count))
        self.count = count.value

    def set(self, structure, **options):
        """Options of one structure, from the next Scene.set_structures on; keyword arguments are StructureOptions'."""
        self.library.structures_set(self.handle, structure, c.byref(self.library.filled(StructureOptions, options)))

    def set_guard(self, **options):
        """Options of the guard for all of them, from the next Scene.set_structures on; GuardOptions' fields."""
        self.library.structures_set_guard(self.handle, c.byref(self.library.filled(GuardOptions, options)))

    def name(self, structure):
        name = c.c_char_p()
        self.library.structures_name(self.handle, structure, c.byref(name))
        return name.value.decode()

    def set_name(self, structure, name):
        self.library.structures_set_name(self.handle, structure, name.encode())

    def __del__(self):
        self.library.structures_destroy(self.handle)


class Protection:
    """Guard and vetoes for a scene, made while it ticks on another thread; Scene.exchange puts them in. None: nothing."""

    def __init__(self, scene, structures=None):
        self.library = scene.library
        self.handle = c.c_void_p()
        self.library.protection_create(scene.handle, structures.handle if structures else None, c.byref(self.handle))

    def totals(self, structure):
        """StructureTotals of what left the scene."""
        made = self.library.options(StructureTotals)
        self.library.protection_structure_totals(self.handle, structure, c.byref(made))
        return made

    def __del__(self):
        self.library.protection_destroy(self.handle)


class Reader:
    """What changed in a grid; may be used on another thread than the scene."""

    def __init__(self, grid):
        self.library = grid.library
        self.handle = c.c_void_p()
        self.library.reader_create(grid.handle, c.byref(self.handle))
        bricks = (c.c_int32 * 3)()
        self.library.reader_bricks(self.handle, bricks)
        self.bricks = tuple(bricks)
        self._room = (c.c_int32 * math.prod(self.bricks))()

    def changed(self):
        count = c.c_size_t()
        self.library.reader_changed(self.handle, self._room, len(self._room), c.byref(count))
        return list(self._room[:count.value])

    def copy(self, brick, typecode="h"):
        """The brick and one voxel round it, x fastest, 10 x 10 x 10; typecode "h" for INT16, "f" for FLOAT32."""
        voxels = array.array(typecode, [0]) * HALOED**3
        buffer = (c.c_char * (len(voxels) * voxels.itemsize)).from_buffer(voxels)
        self.library.reader_copy(self.handle, brick, buffer, len(buffer))
        return voxels

    def __del__(self):
        self.library.reader_destroy(self.handle)


def main(path):
    library = Library(path)
    side = 40  # half of the block is bone: its surface is at 9.7 mm
    hounsfield = array.array("h", [1200] * (side**3 // 2) + [-1000] * (side**3 // 2))
    bone = Grid(library, (side,) * 3, (0.5e-3,) * 3, hounsfield)
    scene = Scene(bone, algorithm=SURFACE, isovalue=300)
    reader = Reader(bone)
    reader.changed()
    for tick in range(1000):
        X_WT = Pose((10e-3, 10e-3, 11.5e-3 - 2e-6 * tick))  # 2 mm/s down, the shaft upright
        result = scene.tick(X_WT, tick >= 500, 1e-3)
        if tick % 100 == 99:
            print(f"{result.force[2]:5.2f} N, {result.removed_total_mm3:5.2f} mm3, {len(reader.changed())} bricks changed")


if __name__ == "__main__":
    import sys

    if len(sys.argv) != 2:
        sys.exit(__doc__)
    try:
        main(sys.argv[1])
    except (Error, OSError) as error:
        sys.exit(f"trephine_c.py: {error}")
