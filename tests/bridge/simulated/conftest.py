"""Common setup of the tests of simulated devices."""

from support.patient_sdk import patient_sdk as patient_sdk
