;;; robosc-mode.el --- RoboSC in Emacs, by eglot  -*- lexical-binding: t; -*-

;;; Commentary:

;; `load' this file in init.el.  The language server is `robosc-lsp'; Emacs 28 gets eglot by
;; M-x package-install RET eglot, later ones have it.

;;; Code:

(defvar eglot-server-programs)
(declare-function eglot-ensure "eglot")

(defvar robosc-mode-syntax-table
  (let ((table (make-syntax-table)))
    (modify-syntax-entry ?/ ". 124b" table)
    (modify-syntax-entry ?* ". 23" table)
    (modify-syntax-entry ?\n "> b" table)
    (modify-syntax-entry ?_ "w" table)
    ;; `^state' is a name: what follows is no word of the language.
    (modify-syntax-entry ?^ "_" table)
    (modify-syntax-entry ?\' "\"" table)
    table)
  "Comments as in C, names with underlines, texts in either quotes.")

(defconst robosc-mode-keywords
  (regexp-opt
   '("action" "always" "and" "array" "behaviour" "boolean" "cancel" "component" "constant"
     "datatype" "default" "disables" "do" "double" "else" "enum" "error" "false" "feedback"
     "from" "goto" "if" "import" "incoming" "initial" "integer" "interface" "library" "links"
     "marked" "message" "needs" "never" "none" "not" "object" "on" "or" "outgoing" "provide"
     "request" "requirement" "response" "robot" "service" "state" "string" "then" "to"
     "transition" "true" "use" "value" "variable" "with")
   'symbols)
  "Words of the language.")

(defconst robosc-mode-goal-words
  '(("^[ \t]*\\(goal\\|assume\\)[ \t]+[^:,.= \t]" 1 'font-lock-keyword-face)
    ("^[ \t]*goal[ \t]+\\(once\\)[ \t]+[a-zA-Z_(!^]" 1 'font-lock-keyword-face)
    ("^[ \t]*assume[ \t]+\\(allow\\)[ \t]+[a-zA-Z_(!^]" 1 'font-lock-keyword-face)
    ("\\_<always[ \t]+\\(eventually\\)\\_>" 1 'font-lock-keyword-face)
    ("\\_<\\(leads\\)[ \t]+to\\_>" 1 'font-lock-keyword-face))
  "Words of goals and assumptions, where they are no names.")

(defconst robosc-mode-mission-words
  '(("^[ \t]*\\(mission\\)[ \t]+\\^?[a-zA-Z_][a-zA-Z_0-9]*[ \t]*\\(?:{\\|while\\_>\\|$\\)" 1 'font-lock-keyword-face)
    ("^[ \t]*\\(?:mission[ \t]+\\^?[a-zA-Z_][a-zA-Z_0-9]*[ \t]+\\)?\\(while\\)[ \t]+[a-zA-Z_0-9(!^-]"
     1 'font-lock-keyword-face)
    ("\\(?:^\\|{\\|\\_<anywhere[ \t]\\)[ \t]*\\(visit\\)[ \t]+[a-zA-Z_0-9(!^-]" 1 'font-lock-keyword-face)
    ("\\_<from[ \t]+\\(anywhere\\)[ \t]*\\(?:visit\\_>\\|$\\)" 1 'font-lock-keyword-face)
    ("^[ \t]*\\(prefer\\)[ \t]+\\(?:{\\|\\^?[a-zA-Z_][a-zA-Z_0-9]*[ \t]*\\(?:over\\_>\\|$\\)\\)"
     1 'font-lock-keyword-face)
    ("^[ \t]*\\(?:prefer[ \t]+\\(?:{[^}\n]*}\\|\\^?[a-zA-Z_][a-zA-Z_0-9]*\\)[ \t]+\\)?\\(over\\)[ \t]+[a-zA-Z_{^]"
     1 'font-lock-keyword-face))
  "Words of missions and preferences, where they are no names.")

(defconst robosc-mode-limit-words
  '(("^[ \t]*\\(limit\\)[ \t]+\\^?[a-zA-Z_][a-zA-Z_0-9]*[ \t]+to\\_>" 1 'font-lock-keyword-face))
  "The word of a limit, where it is no name.")

(defconst robosc-mode-indentation 4 "Columns for each brace, as `eglot-format' has them.")

(defun robosc-mode-indent-line ()
  "Indent a line by the braces around it; comments and texts stay as they are."
  (let* ((state (save-excursion (syntax-ppss (line-beginning-position))))
         (closed (save-excursion (back-to-indentation) (skip-chars-forward ")]}")))
         (column (* robosc-mode-indentation (max 0 (- (car state) closed)))))
    (cond ((nth 8 state) 'noindent)
          ((<= (current-column) (current-indentation)) (indent-line-to column))
          (t (save-excursion (indent-line-to column))))))

;;;###autoload
(define-derived-mode robosc-mode prog-mode "RoboSC"
  "Robots, and what they must never do."
  (setq-local comment-start "// ")
  (setq-local comment-end "")
  (setq-local comment-start-skip "\\(?://+\\|/\\*+\\)[ \t]*")
  (setq-local indent-tabs-mode nil)
  (setq-local indent-line-function #'robosc-mode-indent-line)
  (setq-local electric-indent-chars (append ")]}" electric-indent-chars))
  (setq-local font-lock-defaults `(((,robosc-mode-keywords 0 'font-lock-keyword-face) ,@robosc-mode-goal-words ,@robosc-mode-mission-words ,@robosc-mode-limit-words))))

;;;###autoload
(add-to-list 'auto-mode-alist '("\\.rscd\\'" . robosc-mode))

(with-eval-after-load 'eglot
  (add-to-list 'eglot-server-programs '(robosc-mode . ("robosc-lsp"))))

(defun robosc-mode-connect ()
  "Ask the language server, where there is eglot."
  (when (require 'eglot nil t)
    (eglot-ensure)))

(add-hook 'robosc-mode-hook #'robosc-mode-connect)

(provide 'robosc-mode)
;;; robosc-mode.el ends here
