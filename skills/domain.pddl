; The catalogue of primitives: what each needs and brings about. One action for one file beside this one
; (NAME--SUFFIX is a variant of the primitive NAME). Conventions, kept by planner/task/primitives.py:
; the first argument is the body that moves, and every action that moves a body achieves `away` for it;
; parameters called ?with... are no arguments of the primitive but bound by the task planner.
(define (domain table-cleaning)
  (:requirements :strips :typing)
  (:types
    thing surface - object
    crumb solid - thing          ; a crumb is too small to be grasped
    movable tool - solid
    bin aside - surface          ; what lies in a bin is put away, elsewhere it lies aside
    tabletop dustpan - aside
  )
  (:predicates
    (in_bin ?o - thing ?p - surface)  ; lies in that region, or on the table
    (put_away ?o - thing)             ; lies in some bin
    (holding ?o - thing)
    (hand_empty)
    (is_sponge ?s - tool)
    (graspable ?o - solid)            ; nothing known speaks against a grasp as it lies
    (stuck ?o - solid)                ; there is no way to pick it as it lies
    (away ?o - thing)                 ; isn't where it is known to be in the way
  )
  (:action pick
    :parameters (?o - solid ?from - surface)
    :precondition (and (in_bin ?o ?from) (graspable ?o) (hand_empty))
    :effect (and (holding ?o) (away ?o) (not (in_bin ?o ?from)) (not (put_away ?o)) (not (hand_empty)))
  )
  (:action place
    :parameters (?o - solid ?to - bin)
    :precondition (holding ?o)
    :effect (and (in_bin ?o ?to) (put_away ?o) (away ?o) (hand_empty) (not (holding ?o)))
  )
  (:action place--aside
    :parameters (?o - solid ?to - aside)
    :precondition (holding ?o)
    :effect (and (in_bin ?o ?to) (away ?o) (hand_empty) (not (holding ?o)))
  )
  (:action wipe
    :parameters (?o - crumb ?from - tabletop ?to - dustpan ?with - tool)
    :precondition (and (in_bin ?o ?from) (holding ?with) (is_sponge ?with))
    :effect (and (in_bin ?o ?to) (away ?o) (not (in_bin ?o ?from)))
  )
  (:action drag
    :parameters (?o - solid ?on - tabletop)
    :precondition (and (in_bin ?o ?on) (stuck ?o) (hand_empty))
    :effect (and (graspable ?o) (away ?o))
  )
  (:action drag_aside
    :parameters (?o - solid ?on - tabletop)
    :precondition (and (in_bin ?o ?on) (stuck ?o) (hand_empty))
    :effect (and (away ?o) (not (graspable ?o)))
  )
)
