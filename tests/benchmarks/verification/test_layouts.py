"""One motion in the layouts of simulators, loggers and telephones: read without options, or a question with its answer."""

import json
import re
import shlex

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import conservative as cv
from conservative.benchmarks.verification.recordings.comparison import prepare
from conservative.benchmarks.verification.recordings.table import Options, read
from conservative.errors import BadInput

from .made import FREE, exact

T = 0.5 * np.arange(101) / 100  # turns of at most 1 rad, so that Euler angles and Rodrigues parameters exist
R, W = exact(FREE, T)
TURN = Rotation.from_matrix(R)
XYZW, VECTOR, MRP, MATRIX = TURN.as_quat(), TURN.as_rotvec(), TURN.as_mrp(), R.reshape(-1, 9)
WXYZ = np.roll(XYZW, 1, axis=1)
YPR = TURN.as_euler("ZYX", degrees=True)  # yaw, pitch, roll
ZXZ = TURN.as_euler("ZXZ")
DEG, WORLD = np.degrees(W), (R @ W[..., None])[..., 0]
ZERO, ONE = 0 * T, 0 * T + 1
RANDOM = np.random.default_rng(1)
NOISE = RANDOM.normal(size=(len(T), 3))
LATE = T + 0.003 * RANDOM.random(len(T))
EPOCH = 1.7e9 + T
SEC, NANO = np.floor(1.7e9 + 0.7 + T), np.round(1e9 * ((0.7 + T) % 1))


def names(pattern, parts):
    """Names with a star in the place of each part."""
    return [pattern.replace("*", part) for part in (parts if not isinstance(parts, str) else list(parts))]


def block(pattern, parts, values):
    """Columns of one quantity by their names."""
    return dict(zip(names(pattern, parts), np.asarray(values).T, strict=True))


TIME = {"time": T}
RATE = block("w_* (rad/s)", "xyz", W)
QUAT = block("q_*", "wxyz", WXYZ)
RPY, PQR, NUMBERS = ("roll", "pitch", "yaw"), "pqr", "0123"
NINE = [f"{i}{j}" for i in "123" for j in "123"]

READ = {
    # time
    "a temperature T": {"timestamp": T, "T": 20 + T} | RATE,
    "a temperature temp": {"t": T, "temp": 20 + ZERO, "imu_temp": 20 + T} | RATE,
    "a time T": {"T": T} | RATE,
    "the arrival beside the stamp": {"%time": 1e9 * (1.7e9 + LATE), "field.header.seq": T}
    | {"field.header.stamp": np.round(1e9 * EPOCH)}
    | block("field.angular_velocity.*", "xyz", W),
    "arrival and log times": {"log_time": LATE, "publish_time": LATE + 1e-3, "timestamp": T} | RATE,
    "ROS 2 sec and nanosec": {"header.stamp.sec": SEC, "header.stamp.nanosec": NANO} | QUAT | RATE,
    "ROS 1 secs and nsecs": {"secs": SEC, "nsecs": NANO} | RATE,
    "struct timeval": {"tv_sec": SEC, "tv_usec": NANO / 1e3} | RATE,
    "seconds and microseconds": {"seconds": SEC, "microseconds": NANO / 1e3} | RATE,
    "camel case seconds": {"timeSec": SEC, "timeNanoSec": NANO} | RATE,
    "Unix time in ms": {"unix_ms": np.round(1e3 * EPOCH), "x_pos": T} | RATE,
    "Unix time without unit": {"timestamp": np.round(1e6 * EPOCH)} | RATE,
    "elapsed seconds": {"time": np.round(1e9 * EPOCH), "seconds_elapsed": T} | block("rotationRate*", "XYZ", W) | QUAT,
    "time in other words": {"Elapsed Time (ms)": 1e3 * T} | RATE,
    "simulation time": {"sim_time": T, "dt": ZERO + 0.005, "wall_time": LATE} | RATE,
    "equal times": {"time_s": T, "time_ms": 1e3 * T, "frame": np.arange(len(T))} | RATE,
    # quaternions
    "scalar last by name": TIME | block("quat_*", "xyzw", XYZW) | RATE,
    "parts out of order": TIME | {k: QUAT[k] for k in ("q_y", "q_w", "q_z", "q_x")} | RATE,
    "upper case": {"TIME": T} | block("Q*", "WXYZ", WXYZ) | block("W* [RAD/S]", "XYZ", W),
    "ijk and real": TIME | block("quat_*", ("i", "j", "k", "real"), XYZW) | RATE,
    "qr qi qj qk": TIME | block("q*", "rijk", WXYZ) | RATE,
    "scalar s": TIME | block("q_*", "sxyz", WXYZ) | RATE,
    "a scalar": TIME | block("quaternion *", ("x", "y", "z", "scalar"), XYZW) | RATE,
    "Euler parameters": TIME | block("e*", NUMBERS, WXYZ) | RATE,
    "camel case": {"timeStamp": T} | block("orientationQuat*", "WXYZ", WXYZ) | block("angularVelocity*", "XYZ", W),
    "blanks in names": {"Time [s]": T} | block("Quaternion *", "wxyz", WXYZ) | block("Angular Velocity * [deg/s]", "XYZ", DEG),
    "a name of the body": TIME | block("drone1/attitude_q_*", "wxyz", WXYZ) | block("drone1/w_*", "xyz", W),
    "order in the name": TIME | block("quaternion_xyzw_*", NUMBERS, XYZW) | RATE,
    "TUM": {"#timestamp": T} | block("t*", "xyz", NOISE) | block("q*", "xyzw", XYZW),
    "EuRoC ground truth": {"#timestamp": np.round(1e9 * EPOCH)}
    | block("p_RS_R_* [m]", "xyz", NOISE)
    | block("q_RS_* []", "wxyz", WXYZ)
    | block("v_RS_R_* [m s^-1]", "xyz", NOISE)
    | block("b_w_RS_S_* [rad s^-1]", "xyz", NOISE)
    | block("b_a_RS_S_* [m s^-2]", "xyz", NOISE),
    "EuRoC": {"#timestamp [ns]": np.round(1e9 * T)}
    | block("w_RS_S_* [rad s^-1]", "xyz", W)
    | block("a_RS_S_* [m s^-2]", "xyz", NOISE),
    "ROS topic": {"%time": np.round(1e9 * EPOCH)}
    | block("field.orientation.*", "xyzw", XYZW)
    | block("field.orientation_covariance*", "012345678", np.zeros((len(T), 9)))
    | block("field.angular_velocity.*", "xyz", W)
    | block("field.angular_velocity_covariance*", "012345678", np.zeros((len(T), 9)))
    | block("field.linear_acceleration.*", "xyz", NOISE)
    | block("field.linear_acceleration_covariance*", "012345678", np.zeros((len(T), 9))),
    "ROS odometry": {"%time": np.round(1e9 * EPOCH)}
    | block("field.pose.pose.position.*", "xyz", NOISE)
    | block("field.pose.pose.orientation.*", "xyzw", XYZW)
    | block("field.pose.covariance*", [str(i) for i in range(36)], np.zeros((len(T), 36)))
    | block("field.twist.twist.linear.*", "xyz", NOISE)
    | block("field.twist.twist.angular.*", "xyz", W)
    | block("field.twist.covariance*", [str(i) for i in range(36)], np.zeros((len(T), 36))),
    "PlotJuggler": {"__time": 1.7e9 + LATE}
    | block("/imu/orientation/*", "xyzw", XYZW)
    | block("/imu/angular_velocity/*", "xyz", W)
    | block("/imu/orientation_covariance[*;0]", "012345678", np.zeros((len(T), 9)))
    | {"/imu/header/stamp": EPOCH},
    "MuJoCo free joint": TIME
    | block("qpos[*]", "0123456", np.hstack([NOISE, WXYZ]))
    | block("qvel[*]", "012345", np.hstack([NOISE, W])),
    "MuJoCo ball joint": TIME | block("qpos_*", NUMBERS, WXYZ) | block("qvel_*", "012", W),
    "Unity": {"Time": T} | block("rotation.*", "xyzw", XYZW) | block("angularVelocity.*", "xyz", W),
    "PX4 attitude": {"timestamp": np.round(1e6 * T)}
    | block("*speed", RPY, W)
    | block("q[*]", NUMBERS, WXYZ)
    | block("delta_q_reset[*]", NUMBERS, np.zeros((len(T), 4)))
    | {"quat_reset_counter": ZERO},
    "iOS SensorLog": {"loggingTime(txt)": EPOCH, "loggingSample(N)": np.arange(len(T)) * 1.0}
    | {"accelerometerTimestamp_sinceReboot(s)": LATE}
    | block("accelerometerAcceleration*(G)", "XYZ", NOISE)
    | {"motionTimestamp_sinceReboot(s)": T}
    | block("motion*(rad)", ("Yaw", "Roll", "Pitch"), np.radians(YPR[:, [0, 2, 1]]))
    | block("motionRotationRate*(rad/s)", "XYZ", W)
    | block("motionUserAcceleration*(G)", "XYZ", NOISE)
    | block("motionQuaternion*(R)", "XYZW", XYZW)
    | block("motionGravity*(G)", "XYZ", NOISE),
    "iOS Sensor Logger": {"time": np.round(1e9 * EPOCH), "seconds_elapsed": T}
    | block("rotationRate*", "XYZ", W)
    | block("gravity*", "XYZ", NOISE)
    | block("quaternion*", "WXYZ", WXYZ)
    | block("acceleration*", "XYZ", NOISE)
    | dict(zip(("pitch", "roll", "yaw"), np.radians(YPR[:, [1, 2, 0]]).T, strict=True)),
    "Xsens": {"PacketCounter": np.arange(len(T)) * 1.0, "SampleTimeFine": 1e4 * T, "Time (s)": T}
    | block("Acc_*", "XYZ", NOISE)
    | block("Gyr_* (rad/s)", "XYZ", W)
    | block("Quat_*", ("w", "x", "y", "z"), WXYZ),
    "x-IMU": {"Time (s)": T}
    | block("Gyroscope * (deg/s)", "XYZ", DEG)
    | block("Accelerometer * (g)", "XYZ", NOISE)
    | block("Magnetometer * (uT)", "XYZ", NOISE),
    "phyphox": {"Time (s)": T} | block("Gyroscope * (rad/s)", "xyz", W) | {"Absolute (rad/s)": np.linalg.norm(W, axis=1)},
    "phyphox in German": {"Zeit (s)": T} | block("Gyroskop * (rad/s)", "xyz", W) | {"Absolutwert (rad/s)": ONE},
    "rates in French": {"Temps (s)": T} | block("Vitesse angulaire * (rad/s)", "xyz", W),
    "rates in German": {"Zeit in s": T} | block("Drehrate *-Achse (°/s)", "XYZ", DEG),
    "a unit tells": {"t (s)": T} | block("g* (deg/s)", "xyz", DEG) | block("a* (m/s^2)", "xyz", NOISE),
    # angles
    "NASA axes": TIME | dict(zip(("heading (deg)", "pitch (deg)", "bank (deg)"), YPR.T, strict=True)) | RATE,
    "short names": TIME | dict(zip(("HDG", "PCH", "RLL"), YPR.T, strict=True)) | RATE,
    "angles by name": TIME | dict(zip(("Yaw angle (deg)", "Pitch angle (deg)", "Roll angle (deg)"), YPR.T, strict=True)) | RATE,
    "ori": TIME | block("ori_*", "wxyz", WXYZ) | RATE,
    "roll first": TIME | block("* (deg)", RPY, YPR[:, ::-1]) | block("*_rate (deg/s)", RPY, DEG),
    "estimated angles": TIME | block("est_*_deg", RPY, YPR[:, ::-1]) | RATE,
    "an aircraft": {"t": T}
    | block("* (deg/s)", "PQR", DEG)
    | block("* (deg)", ("Phi", "Theta", "Psi"), YPR[:, ::-1])
    | {"Alpha (deg)": T, "Beta (deg)": T, "Mach": T},
    "JSBSim": {"Time": T}
    | block("/fdm/jsbsim/attitude/*-deg", ("phi", "theta", "psi"), YPR[:, ::-1])
    | block("/fdm/jsbsim/velocities/*-rad_sec", PQR, W),
    "ArduPilot": {"TimeUS": np.round(1e6 * T)}
    | block("*", ("Roll", "Pitch", "Yaw"), YPR[:, ::-1])
    | block("Des*", ("Roll", "Pitch", "Yaw"), NOISE)
    | block("Gyr*", "XYZ", W)
    | block("Acc*", "XYZ", NOISE),
    "MAVLink": {"time_boot_ms": 1e3 * T} | block("*", RPY, np.radians(YPR[:, ::-1])) | block("*speed", RPY, W),
    "commands beside": TIME | block("*_cmd (deg)", RPY, NOISE) | block("* (deg)", RPY, YPR[:, ::-1]) | RATE,
    "setpoints beside": TIME | block("q_sp_*", "wxyz", np.ones((len(T), 4))) | QUAT | RATE,
    "references beside": TIME | block("q_ref_*", "wxyz", np.ones((len(T), 4))) | block("w_ref_*", "xyz", NOISE) | QUAT | RATE,
    "biases and deviations": TIME
    | block("gyro_bias_*", "xyz", NOISE)
    | block("q_std_*", "wxyz", np.ones((len(T), 4)))
    | block("gyro_*_var", "xyz", NOISE)
    | QUAT
    | RATE,
    "temperatures": TIME | {"gyro_temp": T, "gyro_temperature_x": T, "T": T + 20, "T_imu": T} | QUAT | RATE,
    # other kinds
    "Basilisk": {"time [ns]": np.round(1e9 * T)} | block("sigma_BN_*", "012", MRP) | block("omega_BN_B[*]", "012", W),
    "GMAT": {"Sat.ElapsedSecs": T}
    | block("Sat.Q*", "1234", XYZW)
    | block("Sat.AngularVelocity* (deg/s)", "XYZ", DEG)
    | {"Sat.X": T, "Sat.Y": T, "Sat.Z": T},
    "STK": {"Time (EpSec)": T} | block("q*", "1234", XYZW) | block("Body Rates * (deg/sec)", "XYZ", DEG),
    "matrices": TIME | block("R*", NINE, MATRIX) | RATE,
    "matrices with indices": TIME | block("dcm[*", [f"{i}][{j}]" for i in "012" for j in "012"], MATRIX) | RATE,
    "matrices with letters": TIME | block("R_*", [i + j for i in "xyz" for j in "xyz"], MATRIX) | RATE,
    "our own": {"t": T} | block("R_WB_*", NINE, MATRIX) | block("w_WB_B_*", "123", W),
    "rotation vectors": TIME | block("rotvec_*", "xyz", VECTOR) | RATE,
    "positions r": TIME | block("r_*", "xyz", NOISE) | block("v_*", "xyz", NOISE) | QUAT | RATE,
    "wheels": TIME | block("wheel_omega_*", "123", NOISE) | block("rw_speed*", "123", NOISE) | QUAT | RATE,
    "accelerations": TIME | block("angular_acceleration_*", "xyz", NOISE) | block("omega_dot_*", "xyz", NOISE) | RATE,
    "Simulink": {"time": T} | block("omega_b(*) (rad/s)", "123", W) | block("q_b2i(*)", "1234", WXYZ),
    "axis and angle": {"t": T}
    | block("axis_*", "xyz", VECTOR / np.linalg.norm(VECTOR, axis=1)[:, None])
    | {"angle": np.linalg.norm(VECTOR, axis=1)},
    "revolutions": {"t": T} | block("w_* (rpm)", "xyz", W * 30 / np.pi),
    "sigma": {"t": T} | block("sigma_*", "123", MRP) | block("omega_*", "123", W),
    "rx ry rz": {"t": T} | block("r*", "xyz", VECTOR) | RATE,
    "Android": {"timestamp": np.round(1e9 * EPOCH)}
    | block("ROTATION VECTOR *", "XYZ", VECTOR)
    | block("GYROSCOPE * (rad/s)", "XYZ", W)
    | block("ACCELEROMETER * (m/s²)", "XYZ", NOISE)
    | block("ORIENTATION * (°)", "XYZ", YPR)
    | {"Time since start in ms": 1e3 * T},
    "MAVLink sensors": {"time_usec": np.round(1e6 * T)}
    | dict(zip(("xgyro", "ygyro", "zgyro"), W.T, strict=True))
    | dict(zip(("xacc", "yacc", "zacc"), NOISE.T, strict=True)),
    "Betaflight": {"loopIteration": np.arange(len(T)) * 1.0, "time (us)": np.round(1e6 * T)}
    | block("axisP[*]", "012", NOISE)
    | block("axisI[*]", "012", NOISE)
    | block("rcCommand[*]", NUMBERS, np.ones((len(T), 4)))
    | block("setpoint[*]", NUMBERS, np.ones((len(T), 4)))
    | block("gyroADC[*] (deg/s)", "012", DEG)
    | block("accSmooth[*]", "012", NOISE)
    | block("motor[*]", NUMBERS, np.ones((len(T), 4))),
    "Unreal": {"TimeSeconds": T}
    | block("*", ("Roll", "Pitch", "Yaw"), YPR[:, ::-1])
    | block("AngularVelocityDeg*", "XYZ", DEG),
    "Julian days": {"Sat.UTCModJulian": 21545 + T / 86_400, "Sat.ElapsedSecs": T} | block("Sat.Q*", "1234", XYZW),
    "a state with derivatives": {"t": T}
    | block("qdot_*", NUMBERS, np.ones((len(T), 4)))
    | block("q_*", NUMBERS, WXYZ)
    | block("L_*", "xyz", NOISE)
    | RATE,
    "channels": {"t": T} | block("c*", [str(i + 1) for i in range(9)], np.ones((len(T), 9))) | RATE,
    # several sets
    "two IMUs that agree": TIME | block("gyro_1_* (rad/s)", "xyz", W) | block("gyro_2_* (rad/s)", "xyz", W),
    "two attitudes that agree": TIME | QUAT | block("quat2_*", "wxyz", -WXYZ) | RATE,
    "raw and calibrated, with attitudes": TIME
    | block("gyro_raw_*", "xyz", np.round(DEG * 16.4) + 31)
    | block("gyro_* (deg/s)", "xyz", DEG)
    | QUAT,
    "body and world rates": TIME
    | block("omega_body_* (rad/s)", "xyz", W)
    | block("omega_world_* (rad/s)", "xyz", WORLD)
    | QUAT,
    "a second IMU that drifts": TIME | QUAT | block("imu1_w_*", "xyz", W + 0.3 * NOISE) | block("imu2_w_*", "xyz", W),
}
"""Layouts that are read without options."""

ASKED = {
    "PX4 rates": {"timestamp": T + 2e-4, "timestamp_sample": T}
    | block("xyz[*]", "012", W)
    | block("xyz_derivative[*]", "012", NOISE),
    "frames only": {"frame": 200 * T} | RATE,
    "ticks only": {"tick": 200 * T} | RATE,
    "an index only": {" ": np.arange(len(T)) * 1.0} | RATE,
    "two times": {"time_a (s)": T, "time_b (s)": LATE} | RATE,
    "two IMUs": TIME | block("gyro_1_* (rad/s)", "xyz", W) | block("gyro_2_* (rad/s)", "xyz", W + 0.01 * NOISE),
    "raw and filtered": TIME | block("gyro_* (rad/s)", "xyz", W) | block("gyro_filtered_* (rad/s)", "xyz", W + 0.01 * NOISE),
    "two attitudes": TIME | block("q_a_*", "wxyz", WXYZ) | block("q_b_*", "wxyz", WXYZ[::-1]),
    "names of letters": {"stamp_ms": 1e3 * T} | block("a*", "xyz", NOISE) | block("g*", "xyz", W),
    "names in another script": {"время": T} | block("скорость *", ("х", "у", "ц"), W),
    "the same names twice": TIME | block("w_* (rad/s)", "xyz", W) | block("w_* (rad/s) ", "xyz", W + 0.1),
    "only world rates": TIME | QUAT | block("omega_world_* (rad/s)", "xyz", WORLD),
    "only references": TIME | block("q_ref_*", "wxyz", WXYZ),
    "Vicon": {"Frame": 200 * T, "Sub Frame": ZERO} | block("Box:R* (rad)", "XYZ", VECTOR) | block("Box:T* (mm)", "XYZ", NOISE),
    "a state": {"t": T} | block("x[*]", "0123456", np.hstack([WXYZ, NOISE])),
    "42 without a header": {"": T} | block(" *", "123", W),
    "many sensors": TIME | {f"gyro_{i}_{axis} (rad/s)": W[:, j] + i * T for i in range(1000) for j, axis in enumerate("xyz")},
    "Euler angles without a sequence": TIME | block("euler_* (deg)", "zyx", YPR),
}
"""Layouts that are a question: the message names an option with which they are read."""


def rows(*values, separator=",", digits="%.17g"):
    """Lines of numbers."""
    return "\n".join(separator.join(digits % x for x in row) for row in np.column_stack(values)) + "\n"


def cells(form, values, separator=","):
    """Cells with a list of numbers, such as [0.1, 0.2, 0.3]."""
    left, right = form[0].strip(), form[-1].strip()
    return [left + separator.join(f"{x:.17g}" for x in row) + right for row in values]


def listed(header, form, separator, quote='"'):
    """A table with lists of numbers in the cells of quaternions and rates."""
    parts = zip(T, cells(form, WXYZ, separator), cells(form, W, separator), strict=True)
    return header + "\n" + "".join(f"{t:.17g},{quote}{q}{quote},{quote}{w}{quote}\n" for t, q, w in parts)


def lines_of(records):
    return "".join(json.dumps(record) + "\n" for record in records)


def dates(form):
    return [np.datetime64("2026-11-29T12:00:00", "ns") + np.timedelta64(round(1e9 * t), "ns") for t in T]


EACH = list(zip(T.tolist(), WXYZ.tolist(), W.tolist(), SEC.tolist(), NANO.tolist(), strict=True))
WORDS_W = "w_x (rad/s),w_y (rad/s),w_z (rad/s)"
OPTITRACK = (
    "Format Version,1.23,Take Name,Take 1,Capture Frame Rate,200.000000,Rotation Type,Quaternion,Length Units,Meters\n\n"
    ",Type,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body\n"
    ",Name,Box,Box,Box,Box,Box,Box,Box,Box\n,ID,1,1,1,1,1,1,1,1\n"
    ",,Rotation,Rotation,Rotation,Rotation,Position,Position,Position,Mean Marker Error\n"
    "Frame,Time (Seconds),X,Y,Z,W,X,Y,Z,\n"
)
TEXTS = {
    "lists in brackets": ("csv", listed("time,q_wxyz,angular_velocity", "[]", ", ")),
    "lists in brackets, without quotes": ("csv", listed("time,quaternion_wxyz,angular_velocity", "[]", ",", "")),
    "lists of blanks": ("csv", listed("time,quat_wxyz,angular_velocity", "  ", " ")),
    "lists of blanks, without quotes": ("csv", listed("time,quat_wxyz,angular_velocity", "  ", " ", "")),
    "vectors in parentheses": ("csv", listed("time,orientation_wxyz,angular_velocity", "()", " ", "")),
    "vectors in parentheses, with commas": ("csv", listed("Time,rotation_wxyz,angularVelocity", "()", ", ")),
    "JSON lists": ("jsonl", lines_of({"t": t, "q_wxyz": q, "angular_velocity": w} for t, q, w, *_ in EACH)),
    "JSON texts of lists": ("jsonl", lines_of({"t": t, "q_wxyz": str(q), "angular_velocity": str(w)} for t, q, w, *_ in EACH)),
    "JSON stamps": (
        "jsonl",
        lines_of(
            {
                "header": {"stamp": {"sec": s, "nanosec": n}, "frame_id": "imu"},
                "orientation": dict(zip("wxyz", q, strict=True)),
                "orientation_covariance": [0.0] * 9,
                "angular_velocity": dict(zip("xyz", w, strict=True)),
            }
            for _, q, w, s, n in EACH
        ),
    ),
    "JSON dates": (
        "jsonl",
        lines_of(
            {"timestamp": f"{d}Z", "q": dict(zip("wxyz", q, strict=True))} for d, (_, q, *_) in zip(dates(0), EACH, strict=True)
        ),
    ),
    "JSON matrices": ("jsonl", lines_of({"t": t, "R": m.tolist()} for t, m in zip(T.tolist(), R, strict=True))),
    "dates": ("csv", f"date,{WORDS_W}\n" + "".join(f"{d}Z,{r}\n" for d, r in zip(dates(0), rows(W).split(), strict=True))),
    "dates with blanks": (
        "csv",
        f"Timestamp;{WORDS_W.replace(',', ';')}\n"
        + "".join(
            f"{str(d).replace('T', ' ')}+00:00;{r}\n" for d, r in zip(dates(0), rows(W, separator=";").split(), strict=True)
        ),
    ),
    "decimal commas": ("csv", f"Zeit (s);{WORDS_W.replace(',', ';')}\n" + rows(T, W, separator=";").replace(".", ",")),
    "decimal commas and tabs": (
        "txt",
        f"Zeit (s)\t{WORDS_W.replace(',', chr(9))}\n" + rows(T, W, separator="\t").replace(".", ","),
    ),
    "units in a second line": ("csv", "t,w_x,w_y,w_z\ns,rad/s,rad/s,rad/s\n" + rows(T, W)),
    "units in a second line, in brackets": ("csv", "t,w_x,w_y,w_z\n[s],[deg/s],[deg/s],[deg/s]\n" + rows(T, DEG)),
    "OptiTrack": ("csv", OPTITRACK + rows(np.arange(len(T)), T, XYZW, NOISE, ZERO)),
    "Xsens MT Manager": (
        "txt",
        "// Start Time: Unknown\n// Sample rate: 200.0Hz\n// Scenario: 4.9\n"
        "PacketCounter\tTime (s)\tAcc_X\tAcc_Y\tAcc_Z\tGyr_X (rad/s)\tGyr_Y (rad/s)\tGyr_Z (rad/s)\n"
        + rows(np.arange(len(T)), T, NOISE, W, separator="\t"),
    ),
    "an index without a name": ("csv", f",time,{WORDS_W}\n" + rows(np.arange(len(T)), T, W)),
    "text between": (
        "csv",
        f"time,frame_id,{WORDS_W}\n" + "".join(f"{t:.17g},base link,{r}\n" for t, r in zip(T, rows(W).split(), strict=True)),
    ),
    "TUM": ("txt", "# timestamp tx ty tz qx qy qz qw\n" + rows(T, NOISE, XYZW, separator=" ")),
    "dates in words": (
        "csv",
        "Time (UTCG),q1,q2,q3,q4\n"
        + "".join(f"29 Nov 2026 12:00:0{t:.9f},{r}\n" for t, r in zip(T, rows(XYZW).split(), strict=True)),
    ),
    "times of a day": (
        "csv",
        f"time,{WORDS_W}\n" + "".join(f"12:00:0{t:.9f},{r}\n" for t, r in zip(T, rows(W).split(), strict=True)),
    ),
    "texts of a comment": ("csv", f"% motion of a box\n% time,{WORDS_W}\n" + rows(T, W)),
}
"""Texts that are read without options: the ending of the file and its content."""


def write(folder, columns, separator=",", name="log.csv", comma=False):
    """A table of numbers with 17 digits."""
    text = [separator.join(f"{x:.17g}" for x in row) for row in np.column_stack(list(columns.values()))]
    text = [line.replace(".", ",") for line in text] if comma else text
    header = separator.join(name.strip() for name in columns)
    header = [] if not next(iter(columns)) else [header]
    (folder / name).write_text("\n".join([*header, *text]) + "\n")
    return folder / name


def settled(path, **options):
    """The recording, with what only the motion of the scene decides."""
    recording = read(path, Options(**options))
    return prepare(FREE_SCENE, recording, True, None).recording


def compare(recording, attitudes=True, rates=True):
    """The recording has the times, the attitudes and the rates of the motion, as far as the file has them."""
    t = recording.t - recording.t[0]
    np.testing.assert_allclose(t, T, atol=6e-7)  # times since 1970 have 256 ns as their last bit; others measured: 2e-16
    assert (recording.data[0] is not None, recording.data[1] is not None) == (attitudes, rates)
    for found, expected in zip(recording.data, (R, W), strict=True):
        if found is not None:
            np.testing.assert_allclose(found, expected, atol=1e-12)  # measured: 3e-15


def has(columns):
    """Whether columns of a layout are attitudes and rates, by their values."""
    angle = np.linalg.norm(VECTOR, axis=1)
    turns = [angle, *WXYZ.T, *VECTOR.T, *MRP.T, *MATRIX.T, *YPR.T, *np.radians(YPR).T, *ZXZ.T, *np.degrees(ZXZ).T]
    return [
        any(np.array_equal(x, y) for x in columns.values() for y in parts)
        for parts in (turns, [*W.T, *DEG.T, *(W * 30 / np.pi).T])
    ]


@pytest.mark.parametrize("name", READ)
def test_a_layout_is_read_without_options(name, tmp_path):
    recording = settled(write(tmp_path, READ[name]))
    compare(recording, *has(READ[name]))
    assert recording.doubt(None) == ""


@pytest.mark.parametrize("name", TEXTS)
def test_a_text_is_read_without_options(name, tmp_path):
    ending, text = TEXTS[name]
    (tmp_path / f"log.{ending}").write_text(text)
    recording = settled(tmp_path / f"log.{ending}")
    have = [x is not None for x in recording.data]
    compare(recording, *have)
    assert any(have)
    assert recording.doubt(None) == ""


FREE_SCENE = FREE.rename("free", R_WB0=R[0], w_WB_B0=W[0])
GREEK = "phi", "theta", "psi"
UNITS = {
    "rates, rad": (TIME | block("w_*", "xyz", W), {}),
    "rates, deg": (TIME | block("w_*", "xyz", DEG), {}),
    "rates, deg, from another row on": (TIME | block("w_*", "xyz", np.degrees(exact(FREE, T + 0.3)[1])), {}),
    "3-1-3 angles, rad": (TIME | block("*", GREEK, ZXZ), {"euler": "zxz"}),
    "3-1-3 angles, deg": (TIME | block("*", GREEK, np.degrees(ZXZ)), {"euler": "zxz"}),
    "3-1-3 angles with a unit": (TIME | block("* (deg)", GREEK, np.degrees(ZXZ)), {"euler": "zxz"}),
    "angles": (TIME | block("*", RPY, YPR[:, ::-1]), {}),
    "angles and rates": (TIME | block("*", RPY, YPR[:, ::-1]) | block("gyro_*", "xyz", W), {}),
}


@pytest.mark.parametrize("name", UNITS)
def test_a_unit_that_no_name_has_follows_from_the_motion_of_the_scene(name, tmp_path):
    columns, options = UNITS[name]
    recording = settled(write(tmp_path, columns), **options)
    if "another row" in name:
        np.testing.assert_allclose(recording.data[1], exact(FREE, T + 0.3)[1], atol=1e-12)
    else:
        compare(recording, *has(columns))


@pytest.mark.parametrize("spin", [0.0, 1e-3])
def test_a_unit_that_the_motion_does_not_show_is_a_question(spin, tmp_path):
    """A constant rate that the scene does not start with is a motion in any unit."""
    path = write(tmp_path, TIME | block("w_*", "xyz", np.outer(ONE, [0, 0, spin])))
    scene = cv.Scene("ball", cv.RigidBody([1.0, 1.0, 1.0]), np.eye(3), [0.0, 0.0, 5.0], 1.0)
    with pytest.raises(BadInput) as error:
        prepare(scene, read(path, Options()), True, None)
    options = answer(error.value)
    assert list(options) == ["units"]
    assert prepare(scene, read(path, Options(**options)), True, None).recording.layout.open == []


def answer(error):
    """The options that a message offers first."""
    offered = re.findall(r"--(columns|units|euler|quaternion) ('[^']*'|\S+)", str(error.allowed))
    return {option: shlex.split(value.rstrip(",;"))[0] for option, value in reversed(offered)}


@pytest.mark.parametrize("name", ASKED)
def test_a_layout_that_is_not_clear_is_a_question_whose_answer_works(name, tmp_path):
    path = write(tmp_path, ASKED[name])
    with pytest.raises(BadInput) as error:
        settled(path)
    options = answer(error.value)
    assert options
    attitudes, rates = has(ASKED[name])
    options |= {"world": True} if name == "only world rates" else {}
    compare(settled(path, **options), attitudes, rates or "world" in options)


BESIDE = {
    "world rates": (QUAT | RATE, block("omega_world_* (rad/s)", "xyz", WORLD)),
    "the same rates": (QUAT | RATE, block("gyro_* (deg/s)", "xyz", DEG)),
    "the same rates, without attitudes": (RATE, block("gyro_* (deg/s)", "xyz", DEG)),
    "the same attitude": (QUAT | RATE, block("quat2_*", "wxyz", -WXYZ)),
}


@pytest.mark.parametrize("late", [0.0, 0.02])
@pytest.mark.parametrize("name", BESIDE)
def test_a_second_set_is_compared_with_the_first_one_to_the_end(late, name, tmp_path):
    """Numbers that differ behind the first 400 rows, by which the set is found to be the same, forbid "right"."""
    motion, other = BESIDE[name]
    more = np.arange(1000) % len(T)  # a motion that begins again: only columns are compared with each other here
    times = 0.005 * np.arange(1000)
    spoiled = {key: x[more] + late * (np.arange(1000) > 600) for key, x in other.items()}
    path = write(tmp_path, {"time": times} | {key: x[more] for key, x in motion.items()} | spoiled)
    recording = read(path, Options())
    assert bool(recording.doubt(None)) == bool(late)
    assert not late or all(key in recording.doubt(None) for key in other)
    assert set(other) <= set(recording.layout.unused)


REASONS = {
    "T": ("another time", {"timestamp": T, "T": T}),
    "T in K": ("not by its numbers", {"timestamp": T, "T": 20 + ZERO}),
    "T in C": ("its steps differ", {"timestamp": T, "T": 20 + T**2}),
    "gyro_temp": ("a temperature", {"t": T, "gyro_temp": T}),
    "q_cmd_w": ("a command", {"t": T} | block("q_cmd_*", "wxyz", WXYZ)),
    "omega_dot_x": ("a derivative", {"t": T} | block("omega_dot_*", "xyz", W)),
    "w_cov_x": ("a deviation", {"t": T} | block("w_cov_*", "xyz", W)),
    "b_w_RS_S_x [rad s^-1]": ("a bias", {"t": T} | block("b_w_RS_S_* [rad s^-1]", "xyz", W)),
    "pitch (deg)": ("without the other parts", {"t": T, "pitch (deg)": T}),
    "q_lvlh_x": ("a frame that moves", {"t": T} | block("q_lvlh_*", "wxyz", WXYZ)),
    "altitude": ("a position", {"t": T, "altitude": T}),
}


@pytest.mark.parametrize("name", REASONS)
def test_the_reason_of_a_column_that_is_not_used_is_true(name, tmp_path):
    expected, columns = REASONS[name]
    layout = read(write(tmp_path, columns | RATE), Options()).layout
    reason = next(reason for column, reason in layout.unused.items() if column.startswith(name.split(" in ")[0]))
    assert expected in reason
    assert list(layout.used["rates"]) == list(RATE)
