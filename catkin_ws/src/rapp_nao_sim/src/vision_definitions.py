"""The numbers of ALVideoDevice by their names, as old programs import them."""

# ruff: noqa: N816 - NAOqi's spelling

kTopCamera, kBottomCamera = 0, 1

kQQVGA, kQVGA, kVGA, k4VGA, kQQQVGA, kQQQQVGA = 0, 1, 2, 3, 7, 8

kYuvColorSpace, kYUV422ColorSpace, kYUVColorSpace, kRGBColorSpace, kHSYColorSpace, kBGRColorSpace = 0, 9, 10, 11, 12, 13

kCameraBrightnessID, kCameraContrastID, kCameraSaturationID, kCameraHueID, kCameraGainID = 0, 1, 2, 3, 6
kCameraHFlipID, kCameraVFlipID, kCameraAutoExpositionID, kCameraAutoWhiteBalanceID = 7, 8, 11, 12
kCameraResolutionID, kCameraFrameRateID, kCameraExposureID, kCameraSelectID, kCameraSetDefaultParamsID = 14, 15, 17, 18, 19
kCameraExposureAlgorithmID, kCameraSharpnessID, kCameraWhiteBalanceID, kCameraBacklightCompensationID = 22, 24, 33, 34
