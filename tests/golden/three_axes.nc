(three axes at once, slow enough for step smoothing)
$100=80
$101=80
$102=80
$110=600
$111=600
$112=600
$120=50
$121=50
$122=50
G1 X1 Y0.7 Z-0.3 F300
