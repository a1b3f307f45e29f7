"""ALVideoDevice over the qi protocol: what the robot's cameras see, and what their settings make of it."""

import time
from itertools import pairwise

import cv2
import numpy as np
import pytest

QQVGA, QVGA, VGA, VGA4 = range(4)
LUMA, YUV422, YUV, RGB, HSY, BGR = 0, 9, 10, 11, 12, 13
FAST = 30


@pytest.fixture(scope="module")
def video(bodied):
    return bodied.service("ALVideoDevice")


@pytest.fixture
def cameras(video):
    """As new: nobody subscribed, settings as at the start."""
    for handle in video.getSubscribers():
        video.unsubscribe(handle)
    for camera in (0, 1):
        video.setAllParametersToDefault(camera)
    video.setActiveCamera(0)
    return video


@pytest.fixture
def turn_head(bodied, wait_for):
    """Turns the head, and waits until it is still."""
    motion = bodied.service("ALMotion")

    def turn(yaw, pitch):
        motion.angleInterpolationWithSpeed("Head", [yaw, pitch], 0.6)
        wait_for(lambda: motion.getAngles("Head", True) == pytest.approx([yaw, pitch], abs=5e-4))

    return turn


@pytest.fixture
def look(cameras, turn_head):
    """Takes a picture with the head turned ahead, or as told."""
    turned = [None]

    def take(resolution=QVGA, colour=BGR, camera=0, yaw=0.0, pitch=0.0):
        if turned[0] != (yaw, pitch):
            turn_head(yaw, pitch)
            turned[0] = (yaw, pitch)
        handle = cameras.subscribeCamera("look", camera, resolution, colour, FAST)
        image = cameras.getImageRemote(handle)
        assert cameras.releaseImage(handle)
        assert cameras.unsubscribe(handle)
        return np.frombuffer(bytes(image[6]), np.uint8).reshape(image[1], image[0], image[2])

    return take


def alike(one, other):
    """Whether two pictures show the same; the robot that stands trembles a little."""
    small = [cv2.resize(picture, (40, 30), interpolation=cv2.INTER_AREA).astype(int) for picture in (one, other)]
    return float(np.abs(small[0] - small[1]).mean()) < 2


def mean(image):
    return float(image.mean())


@pytest.mark.parametrize(
    ("resolution", "width", "height"), [(QQVGA, 160, 120), (QVGA, 320, 240), (VGA, 640, 480), (VGA4, 1280, 960)]
)
@pytest.mark.parametrize(("camera", "colour", "layers"), [(0, BGR, 3), (1, YUV422, 2)])
def test_an_image_is_naoqis_list(cameras, resolution, width, height, camera, colour, layers):
    handle = cameras.subscribeCamera("test", camera, resolution, colour, FAST)
    before = time.time()
    image = cameras.getImageRemote(handle)
    assert list(image[:4]) == [width, height, layers, colour]
    assert before - 1 <= image[4] + image[5] / 1e6 <= time.time()
    assert len(bytes(image[6])) == width * height * layers
    assert image[7] == camera
    assert list(image[8:]) == pytest.approx([0.532, 0.4157, -0.532, -0.4157], abs=1e-3)


def test_handles_are_counted_to_eight(cameras):
    handles = [cameras.subscribeCamera("many", 0, QQVGA, BGR, 5) for _ in range(9)]
    assert handles == [*(f"many_{i}" for i in range(8)), ""]
    assert cameras.unsubscribe("many_3") is True
    assert cameras.subscribeCamera("many", 1, QQVGA, BGR, 5) == "many_3"
    assert cameras.unsubscribeAllInstances("many") is True
    assert (cameras.unsubscribe("many_0"), cameras.unsubscribeAllInstances("many")) == (False, False)
    assert cameras.getImageRemote("many_0") is None
    assert cameras.releaseImage("many_0") is False


@pytest.mark.parametrize(
    "wrong", [("x", 2, 1, 13, 5), ("x", 0, 5, 13, 5), ("x", 0, 1, 7, 5), ("x", 0, 1, 13, 0), ("", 0, 1, 13, 5)]
)
def test_a_subscription_that_cannot_be_has_no_handle(cameras, wrong):
    assert cameras.subscribeCamera(*wrong) == ""
    assert cameras.getSubscribers() == []


def test_a_subscription_can_be_changed(cameras, failing):
    cameras.setActiveCamera(1)
    handle = cameras.subscribe("old", QQVGA, RGB, 5)
    assert (cameras.getActiveCamera(handle), cameras.getActiveCamera()) == (1, 1)
    assert cameras.setActiveCamera(handle, 0) and cameras.setResolution(handle, QVGA)
    assert cameras.setColorSpace(handle, LUMA) and cameras.setFrameRate(handle, 12)
    found = (cameras.getActiveCamera(handle), cameras.getResolution(handle), cameras.getColorSpace(handle))
    assert (*found, cameras.getFrameRate(handle)) == (0, QVGA, LUMA, 12)
    assert list(cameras.getImageRemote(handle)[:4]) == [320, 240, 1, LUMA]
    refused = [cameras.setResolution(handle, 9), cameras.setColorSpace(handle, 99), cameras.setFrameRate(handle, 99)]
    assert [*refused, cameras.setActiveCamera(2)] == [False] * 4
    with failing("ALVideoDevice::getResolution", "subscribed are ['old_0']"):
        cameras.getResolution("new_0")


def test_pictures_come_no_faster_than_asked_for(cameras):
    handle = cameras.subscribeCamera("slow", 0, QQVGA, BGR, 5)
    stamps = [image[4] + image[5] / 1e6 for image in (cameras.getImageRemote(handle) for _ in range(4))]
    assert all(later - sooner > 0.18 for sooner, later in pairwise(stamps))


def test_physics_and_calls_go_on_while_pictures_are_drawn(cameras, bodied):
    handle = cameras.subscribeCamera("busy", 0, VGA4, BGR, FAST)
    picture = cameras.getImageRemote(handle, _async=True)
    motion, calls = bodied.service("ALMotion"), 0
    motion.setAngles("HeadYaw", 0.5, 1.0)
    while not picture.isFinished():
        motion.getAngles("HeadYaw", True)
        calls += 1
    assert calls >= 10
    assert len(bytes(picture.value()[6])) == 1280 * 960 * 3


def test_a_code_is_read_at_a_metre_and_a_half(look):
    assert cv2.QRCodeDetector().detectAndDecode(look(VGA4))[0] == "the code at 1.5 m"


def test_a_face_is_found(look):
    finder = cv2.CascadeClassifier(cv2.data.haarcascades + "haarcascade_frontalface_default.xml")
    [(x, _, width, _)] = finder.detectMultiScale(look(VGA, LUMA, yaw=0.424, pitch=-0.1), 1.1, 4)
    assert abs(x + width / 2 - 320) < 25
    assert 60 < width < 120


def code_place(image):
    found, corners = cv2.QRCodeDetector().detect(image)
    assert found
    return corners.reshape(-1, 2).mean(axis=0)


def test_the_picture_follows_the_head_as_the_lens_says(look):
    focus, ahead_of_neck, away = 320 / np.tan(np.radians(60.97) / 2), 0.0587, 1.55  # pixels, m, m
    ahead = code_place(look(VGA))
    assert ahead[0] == pytest.approx(320, abs=2)
    left = code_place(look(VGA, yaw=0.3))
    assert left[0] - 320 == pytest.approx(focus * away * np.sin(0.3) / (away * np.cos(0.3) - ahead_of_neck), abs=3)
    down = code_place(look(VGA, pitch=0.15))
    assert down[1] - ahead[1] == pytest.approx(-focus * np.tan(0.15), abs=8)


def test_the_bottom_camera_looks_down(look):
    assert look(camera=1)[:40].std() != pytest.approx(look(camera=0)[:40].std(), abs=1)
    low = look(VGA, camera=1, pitch=-0.6)  # its own tilt nearly undone: it sees the code as the upper one does
    assert code_place(low)[0] == pytest.approx(320, abs=8)


def test_colour_spaces_show_the_same(look):  # of the wooden floor
    bgr = look(pitch=0.4, colour=BGR)
    grey = cv2.cvtColor(bgr, cv2.COLOR_BGR2GRAY)
    assert alike(look(pitch=0.4, colour=RGB)[..., ::-1], bgr)
    assert alike(cv2.cvtColor(look(pitch=0.4, colour=YUV), cv2.COLOR_YUV2BGR), bgr)
    assert alike(look(pitch=0.4, colour=LUMA)[..., 0], grey)
    assert alike(look(pitch=0.4, colour=YUV422)[..., 0], grey)
    assert alike(look(pitch=0.4, colour=HSY)[..., 2], grey)
    assert not alike(look(pitch=0.4, colour=RGB), bgr)


BRIGHTNESS, CONTRAST, SATURATION, HUE, GAIN, FLIP_ACROSS, FLIP_DOWN, AUTO, AUTO_WHITE = 0, 1, 2, 3, 6, 7, 8, 11, 12
EXPOSURE, SHARPNESS, WHITE = 17, 24, 33


def test_exposure_gain_and_brightness(look, cameras):
    usual = mean(look())
    assert cameras.setParameter(0, EXPOSURE, 100) is False  # the automatism has it
    assert cameras.setParameter(0, BRIGHTNESS, 40) is True
    assert mean(look()) < 0.9 * usual
    assert cameras.setParameter(0, AUTO, 0) and cameras.setParameter(0, EXPOSURE, 60)
    dark = mean(look())
    assert dark < 0.5 * usual
    assert cameras.setParameter(0, GAIN, 64) is True
    assert mean(look()) == pytest.approx(2 * dark, rel=0.1)


def test_contrast_saturation_hue_and_white(look, cameras):
    plain = look(yaw=-0.6)  # with the brown door
    assert cameras.setParameter(0, CONTRAST, 64)
    assert look(yaw=-0.6).std() > 1.3 * plain.std()
    cameras.setAllParametersToDefault(0)
    assert cameras.setParameter(0, SATURATION, 0)
    grey = look(yaw=-0.6).astype(int)
    assert (grey.max(axis=2) - grey.min(axis=2)).max() <= 3
    assert cameras.setParameterToDefault(0, SATURATION)
    assert cameras.setParameter(0, HUE, 120)
    assert np.abs(look(yaw=-0.6).astype(int) - plain).mean() > 8
    cameras.setAllParametersToDefault(0)
    assert cameras.setParameter(0, AUTO_WHITE, 0)
    warm = [look().reshape(-1, 3).mean(axis=0) for value in (2700, 6500) if cameras.setParameter(0, WHITE, value)]
    assert warm[1][2] / warm[1][0] > 1.3 * warm[0][2] / warm[0][0]


def test_flips_and_sharpness(look, cameras):
    plain = look()
    assert cameras.setParameter(0, FLIP_ACROSS, 1)
    assert alike(look(), plain[:, ::-1])
    assert not alike(look(), plain)
    assert cameras.setParameter(0, FLIP_DOWN, 1)
    assert alike(look(), plain[::-1, ::-1])
    cameras.setAllParametersToDefault(0)
    assert cameras.setParameter(0, SHARPNESS, 7)
    assert cv2.Laplacian(look(), cv2.CV_64F).std() > 1.3 * cv2.Laplacian(plain, cv2.CV_64F).std()


def test_parameters_are_told_and_kept_in_their_range(cameras, failing):
    assert cameras.getParameterRange(0, CONTRAST) == [16, 64, 32]
    assert [cameras.setParameter(0, CONTRAST, value) for value in (15, 65, 32.5)] == [False] * 3
    assert cameras.setParameter(0, 99, 1) is False
    assert cameras.setParameter(1, CONTRAST, 50) is True
    assert (cameras.getParameter(0, CONTRAST), cameras.getParameter(1, CONTRAST)) == (32, 50)
    assert cameras.getParameter(0, 15) == 5  # pictures per second when nobody looks
    handle = cameras.subscribeCamera("own", 1, VGA, BGR, 12)
    assert (cameras.getParameter(1, 15), cameras.getFrameRate(1), cameras.getParameter(1, 14)) == (12, 12, VGA)
    assert cameras.setCameraParameter(handle, CONTRAST, 40) is True
    assert cameras.getCameraParameter(handle, CONTRAST) == 40
    assert cameras.setAllCameraParametersToDefault(handle) is True
    assert cameras.getParam(CONTRAST, 1) == 32
    assert cameras.setParam(18, 1) is True
    assert cameras.getActiveCamera() == 1
    with failing("ALVideoDevice::getParameter", "17 Exposure"):
        cameras.getParameter(0, 99)
    with failing("ALVideoDevice::getParameter", "0 (top) and 1 (bottom)"):
        cameras.getParameter(3, CONTRAST)


def test_angles_in_the_picture(cameras):
    left, down = cameras.getAngularPositionFromImagePosition(0, [0.0, 1.0])
    assert (left, down) == pytest.approx((cameras.getHorizontalFOV(0) / 2, cameras.getVerticalFOV(1) / 2))
    assert cameras.getImagePositionFromAngularPosition(0, [0.1, -0.1]) == pytest.approx([0.4148, 0.3864], abs=1e-3)
    assert cameras.resolutionToSizes(VGA) == [640, 480]
    assert cameras.sizesToResolution(320, 240) == QVGA


@pytest.fixture
def photos(bodied, cameras):
    photos = bodied.service("ALPhotoCapture")
    photos.setCameraID(0)
    photos.setResolution(QVGA)
    photos.setPictureFormat("png")
    photos.setColorSpace(BGR)
    return photos


def test_a_picture_is_taken_into_a_file_with_the_camera_s_settings(photos, cameras, folder):
    (path,) = photos.takePicture(str(folder), "photo")
    assert path == str(folder / "photo.png")
    assert cv2.imread(path).shape == (240, 320, 3)
    cameras.setParameter(0, 0, 10)
    photos.takePicture(str(folder), "photo", True)
    dark = cv2.imread(path).mean()
    cameras.setParameter(0, 0, 120)
    (path,) = photos.takePicture(str(folder), "photo")
    assert cv2.imread(path).mean() > dark + 5


def test_several_pictures_are_numbered(photos, folder):
    photos.setCameraID(1)
    photos.setResolution(QQVGA)
    photos.setColorSpace(LUMA)
    photos.setPictureFormat("jpg")
    paths = photos.takePictures(2, str(folder), "row")
    assert paths == [str(folder / name) for name in ("row_0.jpg", "row_1.jpg")]
    assert cv2.imread(paths[1], cv2.IMREAD_UNCHANGED).shape == (120, 160)


@pytest.mark.parametrize(
    ("method", "args", "said"),
    [
        ("setCameraID", (2,), "known are 0, 1"),
        ("setResolution", (17,), "cannot use resolution 17"),
        ("setColorSpace", (YUV,), "known are 0, 13"),
        ("setPictureFormat", ("doc",), "known are bmp"),
        ("takePictures", (0, "/tmp", "none"), "1 to 1000"),
        ("takePicture", ("/etc", "photo"), "cannot write /etc/photo"),
    ],
)
def test_a_picture_that_cannot_be_taken_is_told(photos, failing, method, args, said):
    with failing(f"ALPhotoCapture::{method}", said):
        getattr(photos, method)(*args)


def test_a_picture_is_not_overwritten_unless_it_may_be(photos, folder, failing):
    photos.takePicture(str(folder), "kept")
    with failing("ALPhotoCapture::takePicture", "it is there"):
        photos.takePicture(str(folder), "kept", False)
