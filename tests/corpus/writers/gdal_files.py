"""Writes elevation rasters by GDAL and rasterio."""

import math
import os

import numpy
import rasterio
from osgeo import gdal, osr

import shapes

gdal.UseExceptions()
UTM = 32632


def reference(code=UTM):
    crs = osr.SpatialReference()
    crs.SetFromUserInput(code if isinstance(code, str) else f"EPSG:{code}")
    return crs.ExportToWkt()


def data(heights=None, kind=gdal.GDT_Float32, code=UTM, affine=None, no_data=shapes.NO_DATA, set_up=None):
    """The terrain in memory, ready to be copied into a file."""
    heights = shapes.terrain(no_data) if heights is None else heights
    made = gdal.GetDriverByName("MEM").Create("", heights.shape[1], heights.shape[0], 1, kind)
    if code:
        made.SetProjection(reference(code))
    made.SetGeoTransform(affine or (shapes.WEST, shapes.STEP, 0, shapes.NORTH, 0, -shapes.STEP))
    band = made.GetRasterBand(1)
    band.WriteArray(heights)
    if no_data is not None:
        band.SetNoDataValue(no_data)
    if set_up:
        set_up(band)
    return made


def save(name, made, driver="GTiff", **options):
    path = shapes.place("gdal", name)
    settings = [f"{k}={v}" for k, v in options.items()]
    shapes.attempt(path, lambda: gdal.GetDriverByName(driver).CreateCopy(path, made, options=settings).FlushCache())


def layouts():
    for name, options in {
        "plain": {},
        "tiled": {"TILED": "YES", "BLOCKXSIZE": 16, "BLOCKYSIZE": 16},
        "deflate": {"COMPRESS": "DEFLATE"},
        "deflate_predictor_3": {"COMPRESS": "DEFLATE", "PREDICTOR": 3},
        "lzw": {"COMPRESS": "LZW"},
        "lzw_predictor_2": {"COMPRESS": "LZW", "PREDICTOR": 2},
        "packbits": {"COMPRESS": "PACKBITS"},
        "zstd": {"COMPRESS": "ZSTD"},
        "lerc": {"COMPRESS": "LERC"},
        "big": {"BIGTIFF": "YES"},
        "big_endian": {"ENDIANNESS": "BIG"},
        "world_file": {"TFW": "YES", "PROFILE": "BASELINE"},
    }.items():
        save(f"tiff/{name}.tif", data(), **options)
    save("tiff/cog.tif", data(), "COG")
    for name, kind in (
        ("int16", gdal.GDT_Int16),
        ("uint16", gdal.GDT_UInt16),
        ("int32", gdal.GDT_Int32),
        ("float64", gdal.GDT_Float64),
    ):
        low = 0 if kind == gdal.GDT_UInt16 else shapes.NO_DATA
        save(f"types/{name}.tif", data(numpy.round(shapes.terrain(low)), kind, no_data=low))
    no_number = shapes.terrain(math.nan)
    save("types/nan.tif", data(no_number, no_data=math.nan))


def scaled(band, scale, offset, unit=""):
    band.SetScale(scale)
    band.SetOffset(offset)
    band.SetUnitType(unit)


def feet():
    foot, survey = 0.3048, 1200 / 3937
    in_feet = lambda f: numpy.where(shapes.terrain() == shapes.NO_DATA, shapes.NO_DATA, shapes.terrain() / f).astype(
        "f4"
    )
    save("units/ft.tif", data(in_feet(foot), set_up=lambda b: b.SetUnitType("ft")))
    save("units/us_survey_foot.tif", data(in_feet(survey), set_up=lambda b: b.SetUnitType("US survey foot")))
    save("units/compound_feet.tif", data(in_feet(survey), code="EPSG:32632+6360"))
    save("units/decimetres_scaled.tif", data(in_feet(0.1), set_up=lambda b: scaled(b, 0.1, 0, "m")))
    counts = numpy.where(shapes.terrain() == shapes.NO_DATA, -9999, (shapes.terrain() - 100) * 100).astype("i2")
    save("units/int16_scale_offset.tif", data(counts, gdal.GDT_Int16, set_up=lambda b: scaled(b, 0.01, 100)))
    west, north = shapes.WEST / survey, shapes.NORTH / survey
    save(
        "units/plan_in_us_feet.tif",
        data(code=2263, affine=(west, shapes.STEP / survey, 0, north, 0, -shapes.STEP / survey)),
    )


def placement():
    step = shapes.STEP
    save(
        "placed/south_up.tif",
        data(shapes.terrain()[::-1], affine=(shapes.WEST, step, 0, shapes.NORTH - 30 * step, 0, step)),
    )
    save("placed/point.tif", data(set_up=lambda b: b.GetDataset().SetMetadataItem("AREA_OR_POINT", "Point")))
    turn = math.radians(30)
    a, b = step * math.cos(turn), step * math.sin(turn)
    save("placed/rotated.tif", data(affine=(shapes.WEST, a, b, shapes.NORTH, b, -a)))
    save("placed/no_crs.tif", data(code=None))
    degrees = 1 / 3600
    save("placed/degrees.tif", data(code=4326, affine=(8.0, degrees, 0, 47.0, 0, -degrees)))
    save("placed/lambert_laea.tif", data(code=3035, affine=(4321000, step, 0, 3210300, 0, -step)))


def other_formats():
    save("grid.asc", data(), "AAIGrid")
    save("grid_decimals.asc", data(), "AAIGrid", DECIMAL_PRECISION=1)
    save("grid.xyz", data(no_data=None), "XYZ")
    save("grid_header.xyz", data(no_data=None), "XYZ", ADD_HEADER_LINE="YES", COLUMN_SEPARATOR=",")
    # Samples of a tile stand on its edges: 1201 x 1201 of them for a degree.
    heights = numpy.full((1201, 1201), 100, "i2")
    heights[600:, 600:] = 300
    heights[:10, :] = -32768
    save(
        "N47E008.hgt",
        data(heights, gdal.GDT_Int16, 4326, (8 - 0.5 / 1200, 1 / 1200, 0, 48 + 0.5 / 1200, 0, -1 / 1200), -32768),
        "SRTMHGT",
    )
    save(
        "heights.png", data(numpy.round(shapes.terrain(None)), gdal.GDT_UInt16, no_data=None), "PNG", WORLDFILE="YES"
    )
    bare = gdal.GetDriverByName("MEM").Create("", 40, 30, 1, gdal.GDT_UInt16)
    bare.GetRasterBand(1).WriteArray(numpy.round(shapes.terrain(None)))
    save("bare.png", bare, "PNG")
    save("tile.img", data(), "HFA")
    save("tile.bil", data(), "EHdr")
    save("tile.gpkg", data(numpy.round(shapes.terrain(None)), gdal.GDT_Byte, no_data=None), "GPKG")
    save("tile.nc", data(), "netCDF")
    save("tile.grd", data(), "GSBG")


def mosaic():
    save("vrt/whole.tif", data())
    for name, window in (("west", (0, 0, 20, 30)), ("east", (20, 0, 20, 30))):
        gdal.Translate(shapes.place("gdal", f"vrt/{name}.tif"), "gdal/vrt/whole.tif", srcWin=window)
    here = os.getcwd()
    os.chdir("gdal/vrt")
    gdal.BuildVRT("mosaic.vrt", ["west.tif", "east.tif"]).FlushCache()
    gdal.Warp("warped.vrt", "whole.tif", format="VRT", dstSRS="EPSG:25832").FlushCache()
    gdal.Translate("scaled.vrt", "whole.tif", format="VRT", scaleParams=[[100, 300, 1000, 3000]]).FlushCache()
    os.chdir(here)


def by_rasterio():
    """rasterio has another default for what a file of several bands means, and writes masks."""
    shapes.note("rasterio", rasterio.__version__)
    where = rasterio.transform.from_origin(shapes.WEST, shapes.NORTH, shapes.STEP, shapes.STEP)
    common = dict(driver="GTiff", width=40, height=30, crs=f"EPSG:{UTM}", transform=where, dtype="float32")
    with rasterio.open(shapes.place("rasterio", "plain.tif"), "w", count=1, nodata=shapes.NO_DATA, **common) as out:
        out.write(shapes.terrain(), 1)
    with rasterio.Env(GDAL_TIFF_INTERNAL_MASK=True):
        with rasterio.open(shapes.place("rasterio", "mask.tif"), "w", count=1, **common) as out:
            out.write(shapes.terrain(None), 1)
            out.write_mask(shapes.terrain() != shapes.NO_DATA)
    with rasterio.open(
        shapes.place("rasterio", "two_bands.tif"), "w", count=2, nodata=shapes.NO_DATA, **common
    ) as out:
        out.write(shapes.terrain(), 1)
        out.write(numpy.ones((30, 40), "f4"), 2)


shapes.note("gdal", gdal.VersionInfo("RELEASE_NAME"))
for part in (layouts, feet, placement, other_formats, mosaic, by_rasterio):
    shapes.attempt(part.__name__, part)
