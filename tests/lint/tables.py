"""What is allowed where. Rules read these tables; whoever changes the house changes a row here.

A room is a folder with all below it, a file, a pattern of files, or a tuple of these. A file belongs to the room that
names it most closely. FLOORS lists floors from the ground up. A file may include files of its own room and of lower
floors. Rooms of one floor do not know each other.

The folder of a process stands on two floors: below its kinds and pipelines what these share, doors and options; above
them the service, which puts all together.
"""

# Which parts of the tree may include which others; "tests" may include everything but other tests' folders.
PARTS = {
    "common": ("common",),
    "services": ("common", "services"),
    "client": ("common", "client"),
    "tools": ("common", "services", "client", "tools"),
    "tests": ("common", "services", "client", "tools", "tests"),
}
# Processes: nothing in one includes another.
PROCESSES = ("services/data", "services/master", "services/packer", "services/sampler", "client/viewer")
# Rings: nothing outside one includes it, tests aside. What is inside does not know what is around it.
RINGS = ("client/displays", "tools/lab")
# What one folder of tests may use of the others.
SHARED_TESTS = "tests/support"

FLOORS = {
    "common": [
        ["common/core", "common/parallel"],
        ["common/geometry", "common/colour", "common/links"],
        ["common/image", "common/gl"],
        ["common/codec", "common/points"],
        [("common/volume", "common/volume/transfer"), "common/splat", "common/refinement"],
        ["common/volume/slices"],
        ["common/volume/warp"],
        ["common/wire"],
        ["common/scene"],
        ["common/options", "common/metrics"],
        ["common/julia", "common/net"],
    ],
    "services/data": [
        ["services/data/base"],
        ["services/data/texture", "services/data/cloud"],
        ["services/data/gltf", "services/data/vtk", "services/data/mesh/formats"],
        ["services/data/volume/formats"],
        ["services/data/import"],
        ["services/data/served.h"],
        ["services/data/volume", "services/data/mesh", "services/data/julia"],
        ["services/data/surface"],
        ["services/data"],
    ],
    "services/sampler": [
        [("services/sampler/work.h", "services/sampler/epoch_book.h", "services/sampler/retry_clock.h")],
        ["services/sampler/tiles", "services/sampler/volume"],
        ["services/sampler/mesh", "services/sampler/julia", "services/sampler/volume/shear"],
        ["services/sampler"],
    ],
    "services/master": [
        ["services/master/record"],
        [("services/master", "services/master/gate/gate.*", "services/master/master_options.*")],
        [
            "services/master/gate",
            "services/master/tiles",
            "services/master/slabs",
            "services/master/live",
            "services/master/wall",
        ],
        ["services/master/plan.cpp"],
        [
            (
                "services/master/master_*",
                "services/master/session.cpp",
                "services/master/status.cpp",
                "services/master/main.cpp",
            )
        ],
    ],
    "services/packer": [
        ["services/packer/packing.h"],
        ["services/packer/points", "services/packer/slices", "services/packer/pictures"],
        ["services/packer"],
    ],
    "client": [["client/notes", "client/wall"], ["client/stereo"], ["client/viewer"], ["client/displays"]],
    "client/viewer": [
        ["client/viewer/tracking"],
        ["client/viewer/render", "client/viewer/coupling", "client/viewer/input", "client/viewer/hands"],
        ["client/viewer/record"],
        ["client/viewer/display"],
        ["client/viewer/received.h"],
        [("client/viewer/points", "client/viewer/record/event_record.*"),
         ("client/viewer/slices", "client/viewer/record/slice_record.*"), "client/viewer/pictures"],
        [("client/viewer", "client/viewer/display/display_loop.*")],
    ],
    "client/displays": [
        ["client/displays/window/input", "client/displays/window/hands", "client/displays/xr"],
        ["client/displays/window/panel"],
        ["client/displays/window/panel/gui"],
        ["client/displays/window"],
        ["client/displays/main.cpp"],
    ],
    "tools": [
        ["tools/common"],
        ["tools/health", "tools/make_terrain", "tools/lab/make_volume", "tools/wan_relay"],
        ["tools/telesplat/command.h", "tools/telesplat/run/child_process.*"],
        ["tools/telesplat/scene", "tools/telesplat/control"],
        ["tools/telesplat/record"],
        ["tools/telesplat/movie"],
        ["tools/telesplat/report"],
        ["tools/telesplat/run"],
        ["tools/telesplat/sweep"],
        ["tools/telesplat/autostereo", "tools/telesplat/cache", "tools/telesplat/compare",
         "tools/telesplat/inspect", "tools/telesplat/keys"],
        ["tools/telesplat"],
        ["tools/lab"],
    ],
}

# Headers of other people's libraries: pattern of the header -> where it may be included.
# Benchmarks may use what they compare with.
OUTSIDE_HEADERS = [
    (r"msgpack.*", ["common/wire"]),
    (r"zmq.*", ["common/net"]),
    (r"sodium\.h", ["common/net/keys", "common/wire/lease_seal.cpp"]),
    (r"pugixml\.hpp", ["services/data/vtk", "services/data/mesh", "services/data/cloud"]),
    (r"lz(4|ma)\.h", ["services/data/vtk", "tests/unit/data/vtk"]),
    (r"draco/.*", ["services/data/gltf", "tests/unit/data/gltf"]),
    (r"meshoptimizer\.h", ["common/geometry/chunk_code.cpp", "services/data/gltf", "tests/unit/data/gltf"]),
    (r"(gdal|ogr|cpl)[_a-z]*\.h", ["services/data/import"]),
    (r"embree.*", ["services/sampler/mesh", "tests/bench"]),
    (r"OpenImageIO/.*", ["common/image", "tests/bench"]),
    (r"(png\.h|turbojpeg\.h|Imf.*\.h)", ["common/image"]),
    (
        r"epoxy/gl\.h",
        [
            "common/gl",
            "client/viewer/render/gl",
            "client/viewer/render/slices/gl_renderer.cpp",
            "client/displays/window/window.cpp",
            "client/displays/window/frame_presenter.cpp",
            "client/displays/window/panel/gui/gui.cpp",
            "client/displays/xr",
            "tests/support/xr",
            "services/sampler/mesh/raster_sampler.cpp",
            "tests/golden",
        ],
    ),
    (r"(epoxy/egl\.h|EGL/.*)",
     ["common/gl", "client/displays/window/window.cpp", "client/displays/xr", "tests/support/xr"]),
    (r"openxr/.*", ["client/displays/xr", "tests/support/xr"]),
    (r"GLFW/.*", ["client/displays/window/window.cpp", "client/displays/window/panel/gui/gui.cpp"]),
    (r"(imgui|backends/imgui_impl_).*", ["client/displays/window/panel/gui", "tests/unit/window/panel"]),
    (r"GL/.*", []),
    (
        r"toml\+\+/.*",
        [
            "client/wall",
            "common/net/keys",
            "client/stereo/autostereo/panel_file.cpp",
            "services/master/master_record.cpp",
            "tests/unit/master/told_tables_test.cpp",
            "tools/telesplat",
        ],
    ),
    (r"spdlog/.*", ["common/core"]),
    # Which ThreadSanitizer can watch.
    (r"((oneapi/)?tbb(\.h|/(tbb\.h|parallel_.*|task_group\.h|flow.*))|execution)", ["common/parallel"]),
    (r"X11/.*", ["tests/support/virtual_display.cpp"]),
    (r"boost/.*", ["services/master/live/http_endpoint.cpp", "tools/common/inference.cpp", "tools/wan_relay"]),
]

# Folders without a limit of files: data and pages, not sources.
DATA_FOLDERS = ("corpus", "docs", "images")
MOST_FILES = 25
MORE_FILES = {"docs": 32}  # a page a subject, which README.md leads to
MOST_COLUMNS = 120
MOST_FUNCTION_LINES = 60
# Functions that may be longer: (path, name) -> why.
LONG_FUNCTIONS = {}
MOST_MEMBERS = 20
MOST_PARAMETERS = 6
# Functions that may have more: (path, name).
LARGE_CLASSES = {
    ("tools/lab/simulation/network/pipes.h", "SimulatedSocket"),
    ("tools/lab/simulation/scenario.h", "Scenario"),
}
LONG_LISTS = {
    # Halves of one inner loop, inlined into their only callers.
    ("services/sampler/volume/shear/composite-inl.h", "CompositeRow"),
    ("services/sampler/volume/shear/resample-inl.h", "FillRow"),
    ("services/sampler/volume/shear/resample-inl.h", "ResampleRow"),
}

# Patterns that comments and pages do not use, and what to write in their place.
ENGLISH = [
    (r"^(//[/!]?<? |# |\* )?[Oo]f (?!course)", 'begins with "of": begin with a verb or a noun of the code'),
    (r"(?<=[.:] )Of (?!course)", 'a sentence begins with "Of": begin with its subject'),
    (r"^(//[/!]?<? |# )(What|Whatever|Who|Whose|Which|Whether|How|Those) ", "begins with a question word"),
    (r"\bso (many|much)\b(?! (?:more|less|as|of|that))", "name the number"),
    (r"\b(is|are|was|were) none\b|\bnone (is|are)\b", "name a thing by what it is"),
    (r"(?i)\b(nobody|somebody|anybody|everybody)\b", "name the process or the person"),
    (r"(?i)\b(whoever|whomever|whatever|whichever)\b", "name the thing"),
    (r"\bof (which|whom)\b", "make it two sentences"),
    (r"(?i)\bwhat [\w ]{1,30} (is|are) (is|are)\b", "name the thing"),
    (r"\bbut for\b", '"except"'),
]

MESSAGES = "common/wire/"  # files below it declare messages: kName = "..."
PROTOCOL_PAGE = "docs/protocol.md"
VERSION_FILE = "common/wire/limits.h"  # kProtocolVersion
METRICS_PAGE = "docs/metrics.md"
# Flags that pages name of programs that are not ours, or of scripts.
FOREIGN_FLAGS = (
    "build-arg", "build-dir", "exit-code-from", "het-group", "profile", "replay", "resolve-image", "seeds",
)
# Columns whose names are data: the master passes them on.
FOREIGN_COLUMNS = ("viewer", "transfer", "colouring", "clip")
# Files that pages and comments name and that are not in the repository: other people's, or made by a run.
PLACEHOLDERS = ("NAME", "KIND")
FOREIGN_FILES = ("highway.h", "nifti1.h", "nifti2.h", "volume.md", "compose/runs/latest", "compose/.env")
