;;; impasto-mode-test.el --- Tests of the mode  -*- lexical-binding: t; -*-

;;; Commentary:

;; In the folder of the repository:
;;   emacs -Q --batch -L editors/emacs -l editors/emacs/test/impasto-mode-test.el -f ert-run-tests-batch-and-exit

;;; Code:

(require 'ert)
(require 'imenu)
(require 'impasto-mode)

(defconst impasto-test-source
  "//! A file.

use std::bsdf::diffuse;

/// Source: nobody.
material clay {
    param size: length = 0.6 mm in 0.05 mm .. 10 mm;
    let a = position / size; // a comment
    surface = diffuse(reflectance: TWO_PI, normal: a.view, file: \"// text\");
}

fn f(x: float, n: normal = 1.0) -> Own =
    x * 2.0;
")

(defun impasto-test-face (text &optional offset)
  "The face of the first place of TEXT, OFFSET characters on."
  (goto-char (point-min))
  (search-forward text)
  (get-text-property (+ (match-beginning 0) (or offset 0)) 'face))

(ert-deftest impasto-colors ()
  (with-temp-buffer
    (insert impasto-test-source)
    (impasto-mode)
    (font-lock-ensure)
    (dolist (case '(("//! A" font-lock-doc-face)
                    ("Source:" font-lock-constant-face)
                    ("nobody" font-lock-doc-face)
                    ("use" font-lock-keyword-face)
                    ("std" font-lock-constant-face)
                    ("material" font-lock-keyword-face)
                    ("clay" font-lock-type-face)
                    ("param" font-lock-keyword-face)
                    ("size" font-lock-variable-name-face)
                    ("length" font-lock-type-face)
                    ("mm in" font-lock-type-face)
                    ("in 0" font-lock-keyword-face)
                    ("position" font-lock-builtin-face)
                    ("a comment" font-lock-comment-face)
                    ("surface" font-lock-builtin-face)
                    ("reflectance" font-lock-variable-name-face)
                    ("TWO_PI" font-lock-constant-face)
                    ("\"// text" font-lock-string-face)
                    ("f(x" font-lock-function-name-face)
                    ("float" font-lock-type-face)
                    ("normal = 1" font-lock-type-face)
                    ("Own" font-lock-type-face)))
      (let ((face (impasto-test-face (car case))))
        (should (equal (list (car case) (if (consp face) (car face) face)) case))))))

(ert-deftest impasto-index ()
  (with-temp-buffer
    (insert impasto-test-source)
    (impasto-mode)
    (let ((index (imenu--make-index-alist t)))
      (should (equal (mapcar #'car (cdr (assoc "Material" index))) '("clay")))
      (should (equal (mapcar #'car (cdr (assoc "Function" index))) '("f"))))))

(ert-deftest impasto-file-type ()
  (should (equal (assoc-default "a.impasto" auto-mode-alist #'string-match-p) 'impasto-mode)))

(ert-deftest impasto-comments ()
  (with-temp-buffer
    (insert "let a = 1;")
    (impasto-mode)
    (comment-region (point-min) (point-max))
    (should (equal (buffer-string) "// let a = 1;"))))

(ert-deftest impasto-server-command ()
  (let ((impasto-command "/opt/impasto")
        (impasto-scene "scene.toml"))
    (should (equal (impasto-server) '("/opt/impasto" "lsp")))
    (should (equal (plist-get (plist-get (impasto-workspace-configuration) :impasto) :scene) "scene.toml"))))

(ert-deftest impasto-indentation ()
  "Sources of the repository are laid out already: few lines may move."
  (let ((moved 0)
        (total 0))
    (dolist (folder '("stdlib" "materials"))
      (dolist (file (directory-files-recursively folder "\\.impasto\\'"))
        (with-temp-buffer
          (insert-file-contents file)
          (impasto-mode)
          (let ((before (split-string (buffer-string) "\n")))
            (let ((inhibit-message t))
              (indent-region (point-min) (point-max)))
            (let ((after (split-string (buffer-string) "\n")))
              (setq total (+ total (length before)))
              (while before
                (unless (equal (pop before) (pop after))
                  (setq moved (1+ moved)))))))))
    (should (> total 5000))
    (should (< (* moved 200) total))))

;;; impasto-mode-test.el ends here
