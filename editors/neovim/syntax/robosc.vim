" RoboSC: words, texts, numbers and comments. What a name stands for comes from the language server.
if exists("b:current_syntax")
  finish
endif

syntax case match
syntax keyword roboscWord action always and array behaviour boolean cancel component constant datatype default
syntax keyword roboscWord disables do double else enum error false feedback from goto if import incoming initial
syntax keyword roboscWord integer interface library links marked message needs never none not object on or outgoing
syntax keyword roboscWord provide request requirement response robot service state string then to transition true
syntax keyword roboscWord use value variable with
" Words of goals and assumptions, where they are no names.
syntax match roboscWord "^\s*\zs\%(goal\|assume\)\>\ze\s\+[^:,.=[:blank:]]"
syntax match roboscWord "\%(^\s*goal\s\+\)\@<=once\>\ze\s\+\%(and\>\|or\>\|leads\>\)\@![[:alpha:]_(!^]"
syntax match roboscWord "\%(^\s*assume\s\+\)\@<=allow\>\ze\s\+\%(and\>\|or\>\|leads\>\)\@![[:alpha:]_(!^]"
syntax match roboscWord "\%(\<always\s\+\)\@<=eventually\>"
syntax match roboscWord "\<leads\>\ze\s\+to\>"
" Words of missions and preferences, where they are no names.
syntax match roboscWord "^\s*\zsmission\>\ze\s\+\^\?\h\w*\s*\%({\|while\>\|$\)"
syntax match roboscWord "\%(^\s*\%(mission\s\+\^\?\h\w*\s\+\)\?\)\@<=while\>\ze\s\+[[:alnum:]_(!^-]"
syntax match roboscWord "\%(^\s*\|{\s*\|\<anywhere\s\+\)\@<=visit\>\ze\s\+[[:alnum:]_(!^-]"
syntax match roboscWord "\%(\<from\s\+\)\@<=anywhere\>\ze\s*\%(visit\>\|$\)"
syntax match roboscWord "^\s*\zsprefer\>\ze\s\+\%({\|\^\?\h\w*\s*\%(over\>\|$\)\)"
syntax match roboscWord "\%(^\s*\%(prefer\s\+\%({[^}]*}\|\^\?\h\w*\)\s\+\)\?\)\@<=over\>\ze\s\+[[:alpha:]_{^]"
" A limit, where the word is no name.
syntax match roboscWord "^\s*\zslimit\>\ze\s\+\^\?\h\w*\s\+to\>"
" A word of the language as a name.
syntax match roboscName "\^\h\w*"
syntax match roboscNumber "\<\d\+\%(\.\d\+\)\?\>"
syntax region roboscText start=+"+ skip=+\\.+ end=+"+
syntax region roboscText start=+'+ skip=+\\.+ end=+'+
syntax match roboscComment "//.*" contains=@Spell
syntax region roboscComment start="/\*" end="\*/" contains=@Spell
syntax sync fromstart

highlight default link roboscWord Keyword
highlight default link roboscName Identifier
highlight default link roboscNumber Number
highlight default link roboscText String
highlight default link roboscComment Comment

let b:current_syntax = "robosc"
