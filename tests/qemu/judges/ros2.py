"""Bags of ROS 2 by two writers: `mcap-ros2-support` of Foxglove (one file) and `rosbags` of Ternaris (folders).

Arguments: path, and the form: "none", "lz4" or "zstd" (chunks of one file), "storage" (folder, chunks packed), "file" (folder, file
packed), "message" (folder, messages packed) or "sqlite" (folder).
Standard input, a line a message: "imu NS gx gy gz ax ay az", "fix NS status lat lon h e n u kind", "velocity NS e n u". Messages are logged
7 ms after their stamps. There is a camera, too.
"""

import sys
from types import SimpleNamespace

import numpy as np
from mcap.writer import CompressionType
from mcap_ros2.writer import Writer as FileWriter
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
from rosbags.rosbag2 import Writer as FolderWriter
from rosbags.typesys import Stores, get_typestore

TOPICS = {
    "imu": ("/imu/data", "sensor_msgs/msg/Imu"),
    "fix": ("/gnss/fix", "sensor_msgs/msg/NavSatFix"),
    "velocity": ("/gnss/velocity", "geometry_msgs/msg/TwistWithCovarianceStamped"),
    "camera": ("/camera", "std_msgs/msg/String"),
}
types = get_typestore(Stores.ROS2_HUMBLE)


def make(name, **fields):
    return types.types[name](**fields)


def vector(x, y, z):
    return make("geometry_msgs/msg/Vector3", x=x, y=y, z=z)


def header(ns, frame):
    stamp = make("builtin_interfaces/msg/Time", sec=ns // 10**9, nanosec=ns % 10**9)
    return make("std_msgs/msg/Header", stamp=stamp, frame_id=frame)


def diagonal(size, *values):
    out = np.zeros((size, size))
    out[range(len(values)), range(len(values))] = values
    return out.ravel()


def message(kind, ns, values):
    if kind == "imu":
        orientation = make("geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=0.0, w=1.0)
        return make(
            TOPICS[kind][1],
            header=header(ns, "imu_link"),
            orientation=orientation,
            orientation_covariance=diagonal(3, -1.0),
            angular_velocity=vector(*values[:3]),
            angular_velocity_covariance=diagonal(3, 1e-6, 1e-6, 1e-6),
            linear_acceleration=vector(*values[3:]),
            linear_acceleration_covariance=diagonal(3, 1e-4, 1e-4, 1e-4),
        )
    if kind == "fix":
        status, latitude, longitude, altitude, *variances, covariance_kind = values
        return make(
            TOPICS[kind][1],
            header=header(ns, "gps"),
            status=make("sensor_msgs/msg/NavSatStatus", status=int(status), service=1),
            latitude=latitude,
            longitude=longitude,
            altitude=altitude,
            position_covariance=diagonal(3, *variances),
            position_covariance_type=int(covariance_kind),
        )
    if kind == "velocity":
        twist = make("geometry_msgs/msg/Twist", linear=vector(*values), angular=vector(0.0, 0.0, 0.0))
        with_covariance = make("geometry_msgs/msg/TwistWithCovariance", twist=twist, covariance=diagonal(6, 0.01, 0.04, 0.09))
        return make(TOPICS[kind][1], header=header(ns, "gps"), twist=with_covariance)
    return make(TOPICS[kind][1], data="x" * 20_000)


def plain(value):
    """What the dynamic encoder of mcap-ros2-support takes: no numpy."""
    if isinstance(value, np.ndarray):
        return value.tolist()
    if hasattr(value, "__dataclass_fields__"):
        names = [name for name in value.__dataclass_fields__ if not name.startswith("__")]
        return SimpleNamespace(**{name: plain(getattr(value, name)) for name in names})
    return value


def messages():
    for k, line in enumerate(sys.stdin):
        kind, ns, *values = line.split()
        yield kind, int(ns), message(kind, int(ns), [float(value) for value in values])
        if k % 100 == 0:
            yield "camera", int(ns), message("camera", int(ns), [])


def one_file(path, compression):
    with open(path, "wb") as file:
        writer = FileWriter(file, chunk_size=200_000, compression=compression)
        schemas = {}
        for kind, ns, content in messages():
            topic, name = TOPICS[kind]
            if kind not in schemas:
                text, _ = types.generate_msgdef(name, ros_version=2)
                schemas[kind] = writer.register_msgdef(name, text)
            writer.write_message(topic, schemas[kind], plain(content), log_time=ns + 7_000_000)
        writer.finish()


def folder(path, form):
    storage = StoragePlugin.SQLITE3 if form == "sqlite" else StoragePlugin.MCAP
    writer = FolderWriter(path, version=9, storage_plugin=storage)
    if form != "sqlite":
        writer.set_compression(CompressionMode[form.upper()], CompressionFormat.ZSTD)
    with writer:
        connections = {}
        for kind, ns, content in messages():
            topic, name = TOPICS[kind]
            if kind not in connections:
                connections[kind] = writer.add_connection(topic, name, typestore=types)
            writer.write(connections[kind], ns + 7_000_000, types.serialize_cdr(content, name))


path, form = sys.argv[1:]
if form in ("none", "lz4", "zstd"):
    one_file(path, CompressionType[form.upper()])
else:
    folder(path, form)
