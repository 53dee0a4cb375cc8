"""Writes volumes by nibabel, tifffile, scikit-image and Pillow."""

import nibabel
import numpy
import PIL
import PIL.Image
import skimage
import skimage.io
import tifffile

import shapes

# nibabel's first axis is x, its world is right, anterior, superior; the shapes' world is left, posterior, superior.
AFFINE = numpy.diag([-1, -1, 1, 1]) @ numpy.array(
    [[s if i == j else 0 for j in range(3)] + [o] for i, (s, o) in enumerate(zip(shapes.SPACING, shapes.ORIGIN))]
    + [[0, 0, 0, 1]]
)


def xyz(kind="i2"):
    return shapes.volume(kind).transpose(2, 1, 0)


def nifti():
    def save(name, made):
        shapes.attempt(name, lambda: nibabel.save(made, shapes.place("nibabel", name)))

    for kind in ("u1", "i1", "i2", "u2", "i4", "u4", "i8", "u8", "f4", "f8"):
        values = xyz("i2") // 2 if kind == "i1" else xyz(kind)
        save(f"types/{kind}.nii", nibabel.Nifti1Image(values.astype(kind), AFFINE, dtype=kind))
    save("plain.nii.gz", nibabel.Nifti1Image(xyz(), AFFINE))
    save("two.nii", nibabel.Nifti2Image(xyz(), AFFINE))
    save("two.nii.gz", nibabel.Nifti2Image(xyz(), AFFINE))
    save("pair/pair.img", nibabel.Nifti1Pair(xyz(), AFFINE))
    save("big_endian.nii", nibabel.Nifti1Image(xyz(">i2"), AFFINE, nibabel.Nifti1Header(endianness=">")))
    scaled = nibabel.Nifti1Image(xyz("f4"), AFFINE)
    scaled.set_data_dtype("i2")
    save("floats_as_int16.nii", scaled)
    fixed = nibabel.Nifti1Image(xyz(), AFFINE)
    fixed.header.set_slope_inter(0.5, -10)
    save("slope_half.nii", fixed)
    for name, q, s in (("qform", 1, 0), ("sform", 0, 1)):
        one = nibabel.Nifti1Image(xyz(), AFFINE)
        one.set_qform(AFFINE, q)
        one.set_sform(AFFINE, s)
        save(f"{name}_only.nii", one)
    turned = xyz()[:, ::-1, :].transpose(2, 0, 1)
    flip = AFFINE @ numpy.array([[1, 0, 0, 0], [0, -1, 0, 19], [0, 0, 1, 0], [0, 0, 0, 1]])
    save("other_axes.nii", nibabel.Nifti1Image(turned, flip @ numpy.eye(4)[:, [2, 0, 1, 3]]))
    rgb = numpy.zeros(shapes.SIZE, [("R", "u1"), ("G", "u1"), ("B", "u1")])
    rgb["R"] = rgb["G"] = rgb["B"] = xyz("u1")
    save("rgb.nii", nibabel.Nifti1Image(rgb, AFFINE))
    save("steps.nii", nibabel.Nifti1Image(numpy.stack([xyz(), xyz()[::-1], xyz()], 3), AFFINE))
    save("vector.nii", nibabel.Nifti1Image(numpy.stack([xyz("f4")] * 3, 3)[:, :, :, None, :], AFFINE))
    save("analyze/old.img", nibabel.AnalyzeImage(xyz(), AFFINE))
    save("free.mgz", nibabel.freesurfer.MGHImage(xyz("i4"), AFFINE))
    micrometres = nibabel.Nifti1Image(xyz(), AFFINE)
    micrometres.header.set_xyzt_units("micron")
    save("micrometres.nii", micrometres)


def stacks():
    shades = shapes.volume("u1")
    wide = shapes.volume("u2")
    for name, array, options in (
        ("plain.tif", wide, {}),
        ("bytes.tif", shades, {}),
        ("floats.tif", shapes.volume("f4"), {}),
        (
            "imagej.tif",
            wide,
            {"imagej": True, "resolution": (1, 1 / 1.5), "metadata": {"axes": "ZYX", "spacing": 2.0, "unit": "mm"}},
        ),
        ("imagej_contiguous.tif", wide, {"imagej": True, "contiguous": True}),
        (
            "ome.ome.tif",
            wide,
            {"metadata": {"axes": "ZYX", "PhysicalSizeX": 1.0, "PhysicalSizeY": 1.5, "PhysicalSizeZ": 2.0}},
        ),
        ("deflate.tif", wide, {"compression": "zlib"}),
        ("deflate_predictor.tif", wide, {"compression": "zlib", "predictor": True}),
        ("tiles.tif", wide, {"tile": (16, 16)}),
        ("big.tif", wide, {"bigtiff": True}),
        ("big_endian.tif", wide, {"byteorder": ">"}),
        ("white_is_zero.tif", 255 - shades, {"photometric": "miniswhite"}),
    ):
        path = shapes.place("tifffile", name)
        shapes.attempt(path, lambda: tifffile.imwrite(path, array, **{"photometric": "minisblack", **options}))
    for z in range(16):
        shapes.attempt(
            "skimage",
            lambda: skimage.io.imsave(
                shapes.place("skimage", f"png/slice_{z:03}.png"), shades[z], check_contrast=False
            ),
        )
        shapes.attempt(
            "skimage",
            lambda: skimage.io.imsave(shapes.place("skimage", f"png16/s{z}.png"), wide[z], check_contrast=False),
        )
        shapes.attempt(
            "skimage",
            lambda: skimage.io.imsave(shapes.place("skimage", f"tif/{z:04}.tif"), wide[z], check_contrast=False),
        )
        PIL.Image.fromarray(shades[z]).save(shapes.place("pillow", f"png/z{z:02}.png"), optimize=True)
        PIL.Image.fromarray(shades[z]).convert("P").save(shapes.place("pillow", f"palette/z{z:02}.png"))
        PIL.Image.fromarray(shades[z]).convert("RGB").save(shapes.place("pillow", f"rgb/z{z:02}.png"))
        PIL.Image.fromarray(shades[z]).save(shapes.place("pillow", f"jpeg/z{z:02}.jpg"), quality=95)
        PIL.Image.fromarray(shades[z]).save(shapes.place("pillow", f"bmp/z{z:02}.bmp"))
    pages = [PIL.Image.fromarray(s) for s in shades]
    pages[0].save(shapes.place("pillow", "pages.tif"), save_all=True, append_images=pages[1:])
    pages[0].save(
        shapes.place("pillow", "pages_lzw.tif"), save_all=True, append_images=pages[1:], compression="tiff_lzw"
    )


for name, module in (("nibabel", nibabel), ("tifffile", tifffile), ("skimage", skimage), ("pillow", PIL)):
    shapes.note(name, module.__version__)
for part in (nifti, stacks):
    shapes.attempt(part.__name__, part)
