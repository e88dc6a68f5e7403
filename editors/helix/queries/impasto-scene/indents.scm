; A scene is TOML.

; inherits: toml
